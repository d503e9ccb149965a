"""What a user points at on a robot lights up: in the scene, in the network, in the servos' plot.

Read in this order:

- ``picking``: which module, rod or cable lies under the pointer, and what it is called.
- ``seen``: the robots of a scene that can be pointed at, each alone or in a lane.
- ``pointing``: lights up a module, names a rod or cable and tells its force while it plays; its script is
  ``pointing.js``.
"""
