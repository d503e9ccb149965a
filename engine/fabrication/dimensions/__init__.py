"""The figures to build a robot by: lengths, sections, tensions, turns. Nothing here has a shape yet.

Each is worked out from the body's genes, the simulated model and the materials. Read in this order:

- ``tolerances``: how far a built robot may differ from the simulated one.
- ``floating_module``: one module simulated at rest, and what it must measure released and contracted.
- ``acceptance``: what is measured of a finished module, and what is wrong if it is not as simulated.
- ``rubber``: how a stretched strip pulls.
- ``cables``: how the passive cables of a module are made: length, section, strain.
- ``cable_problems``: which of them cannot be made or would not last, and what would help.
- ``limiter``: what gives way when an internal cable pulls more than the simulated servo does.
- ``cut_lists``: every cable and every rod, one a row, and how many rods to buy.
- ``joints``: which face joins the next module, with which nodes and in which turn.
- ``feet``: which rod ends get feet that grip one way, and where each points.
- ``pull_test``: the coupon that is pulled before the nets are made.
"""
