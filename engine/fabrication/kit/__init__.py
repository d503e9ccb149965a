"""A kit for one module: what to buy and what it costs, a jig, a form to fill in.

Whoever builds a robot builds its first module, measures it, and only then the others. Read in this order:

- ``lone_module``: a robot's module without the others.
- ``purchases``: what to buy for it, with prices and hours.
- ``power``: wire, connector, fuse and supply by the number of servos.
- ``jig``: holds the six rods while the net goes on.
- ``measured``: the materials file as a form, in the order of measuring.
"""
