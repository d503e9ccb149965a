"""What a robot is: genes and geometry. Nothing moves here, and nothing is simulated.

Read in this order:

- ``module``: one tensegrity module: nodes, rods, cables, faces, masses, stiffness.
- ``feet``: feet that grip one way.
- ``morphology``: the genotype of a body, how it is drawn, mutated and changed by hand.
- ``servo``: from a controller's outputs to the lengths of the internal cables.
- ``kinematics``: quaternions, and lengths and tensions of cables in a pose.
- ``forces``: what cables pull and rods bear in a pose.
"""
