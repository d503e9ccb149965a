"""The papers of a kit for one module: what to buy, step by step in pictures, the net at 1:1.

What a module is made of and how it is put together is on the robot's build sheet; its sections are printed
here, too, for one module. Read in this order:

- ``scene_pictures``: pictures of parts of a GLB scene.
- ``module_scene``: the scene of one module in its jig.
- ``steps``: one action per picture.
- ``costs``: what to buy, prices, hours, power.
- ``tiles``: the net at 1:1 over several sheets.
- ``kit_sheet``: all of it but the tiles, as one PDF.
"""
