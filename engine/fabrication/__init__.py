"""A body as parts, lists and firmware: genes and SI figures go in, tables and files come out.

What the simulation knows comes from the robot's model, everything else from a materials file. Every number
says which of the two it is (``materials.Source``). The build sheet, which shows all this on paper, is
``viz.build_sheet``; ``app.downloads.robot_folder`` puts the whole folder for download together. Read in this
order; nothing imports what stands below it:

- ``materials/``: what the robot is built from, read from a TOML file or a preset.
- ``dimensions/``: the figures to build it by: lengths, sections, tensions, turns, cut lists.
- ``parts/``: the shapes of its parts, as meshes, drawings and one scene.
- ``bill_of_materials``: every part with its quantity, size and mass.
- ``mass_balance``: simulated against built mass, and the counterweight of the servo.
- ``buildability``: why a robot cannot be built or would not work, and what would help.
- ``as_built/``: how the built robot differs from the simulated one, and its simulation with all of that.
- ``firmware/``: the controller as an Arduino sketch, its gaits, and what it says to a host.
- ``markers``: the tags by which a camera finds head and target.
- ``kit/``: what it takes to buy, build and measure one module before the others.
- ``folder``: all files to cut, print and buy from, by name.
"""
