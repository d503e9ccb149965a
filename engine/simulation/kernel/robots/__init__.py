"""What the kernel knows of the robots that it simulates.

Read in this order:

- ``parameters``: every number of a robot, read from a compiled MuJoCo model.
- ``scope``: which models are refused.
- ``model``: the robots of a vector's lanes, and places, by which what links join is kept.
"""
