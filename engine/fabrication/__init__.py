"""The physical numbers and the geometry of one robot: materials, cables, rods, masses, net, parts, firmware.

Whatever the simulation knows comes from the robot's model; whatever it does not know comes from a
materials file. Every number says which of the two it is (``quantity.Source``).
"""
