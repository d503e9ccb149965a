"""How far a built robot may differ from the simulated one, in SI units: the designer's judgement, assumed."""

from typing import Final

ROD: Final = 0.0003
"""Of a rod, from node to node, in m."""
REST: Final = 0.0005
"""Of a passive cable's rest length between the rod ends, and of a ring's place on its rod, in m."""
STIFFNESS: Final = 0.1
"""Of a passive cable's stiffness, in parts of it."""
STIFFNESS_WITHIN: Final = 0.05
"""The same among the cables of one module."""
INTERNAL_CABLE: Final = 0.0005
"""Of an internal cable's length at both ends of the servo's travel, in m. It moves rod ends by half a
millimetre where a module contracts by 8 to 43 mm."""
TRAVEL: Final = 3.0
"""Of the angle between the servo's two ends, in degrees."""
MASS: Final = 0.1
"""Of a module's mass, in parts of it."""
LINK: Final = 0.001
"""Of the distance of joined nodes where the robot rests, in m."""
SIZE: Final = 0.005
"""Of the settled robot's width and height, in m; of its length, with ``LINK`` for every joint besides."""
