"""One time step of robots of free rods and straight cables, on a plane and between boxes.

Read in this order:

- ``state``: what a simulation is between two steps.
- ``motion``: free motion: cables, servos, gravity, turning.
- ``softness``: MuJoCo's impedance and reference acceleration. ``friction``: the cone.
- ``feet``: friction of feet that grip one way.
- ``contact``: one contact. ``ground``, ``walls``, ``capsule_box``, ``rod_contacts``: where rods touch what.
- ``links``: limits of the links between modules.
- ``solver``: sweeps over islands until each settles. ``descent``: those whose contacts settle slowly.
"""
