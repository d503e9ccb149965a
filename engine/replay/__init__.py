"""A trial simulated again, to be looked at. Nothing here is kept in a run file.

Read in this order:

- ``trial``: which trial of a robot, and a target of one's own.
- ``recording``: frames, what lies between them, contacts; what the player asks of a recording.
- ``replay``: a trial exactly as it was evaluated.
- ``what_if``: another body with the same controller.
- ``dump``: a failed simulation as a file. ``dump_replay``: its last moments.
"""
