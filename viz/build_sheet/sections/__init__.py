"""The sections of a build sheet: one file for each, whose ``pages`` returns what is printed.

A section imports no other one; what several need lies in ``viz/build_sheet/``. To add a section, imitate
``joining``, call its ``pages`` in ``sheet`` where it shall stand, and name it here.

In the order of the pages:

1. ``title``: which robot this is, how it looks, how to use the sheet.
2. ``performance``: what to expect of it.
3. ``drawings``: the settled robot from above and from the side.
4. ``shopping``: what to order and what to print.
5. ``bill_of_materials``: its parts, tools, and whether it weighs what was simulated.
6. ``cut_list``: rods, passive cables, and the pull test.
7. ``net``: nodes and faces of a module's net.
8. ``assembly``: how one module is built, step by step.
9. ``joining``: how the modules are joined.
10. ``feet``: which foot that grips one way goes where, and the test of their friction.
11. ``wiring``: wiring, program, pin map, cable lengths.
12. ``steering``: camera, and the tags by which it finds head and target.
13. ``checks``: safety, tolerances, checks.
14. ``sources``: where the numbers come from.
"""
