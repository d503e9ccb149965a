"""The closed loop inside compiled code: sense, network, servos, noise, physics.

Read in this order:

- ``sensing``: what the built-in tasks sense and score. ``network``: the controller.
- ``servos``: commanded lengths. ``noise``: a counter-based generator.
- ``setup``: everything that the loop holds between two calls.
- ``closed_loop``: the loop. ``dropped``: settling and the search for the head.
- ``trials``: trials of one robot from Python.
"""
