"""A trial simulated again for viewing. Nothing here is stored in a run file.

Read in this order:

- ``trial``: which trial of a robot, and a target that the user places.
- ``recording``: frames, interpolation between them, contacts; the player's interface to a recording.
- ``frames``: frames of what was recorded at once.
- ``replay``: a trial exactly as it was evaluated.
- ``every_target``: many robots' trials at once.
- ``contact_record``: where rod ends touched the ground in such trials, and which way they slid.
- ``what_if``: another body with the same controller.
- ``dump``: a failed simulation as a file. ``dump_replay``: its last moments.
"""
