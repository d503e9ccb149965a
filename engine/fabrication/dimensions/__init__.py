"""The figures to build a robot by: lengths, sections, tensions, turns. Nothing here has a shape yet.

Each is worked out from the body's genes, the simulated model and the materials. Read in this order:

- ``tolerances``: how far a built robot may differ from the simulated one.
- ``floating_module``: one module simulated at rest, and what it must measure released and contracted.
- ``cables``: how the passive cables of a module are made: section, length along the rods, strain.
- ``cable_problems``: which of them cannot be made or would not last, and what would help.
- ``cut_lists``: every cable and every rod, one a row, and how many rods to buy.
- ``joints``: which face joins the next module, with which nodes and in which turn.
- ``feet``: which rod ends get feet that grip one way, and where each points.
- ``pull_test``: the coupon to print and pull before the cables are made.
"""
