"""The robot as it would be built: how it differs from the simulated one, and its simulation with that.

One description holds every difference, with its value, its spread and where these come from. The simulation
takes it as ``simulation.built.Built`` and ``Spread``, whichever simulator is used. Read in this order:

- ``deviation``: one difference, and how it is known.
- ``body``, ``drive``, ``surroundings``: the differences, from the materials and the design.
- ``deviations``: all of them.
- ``twin``: the description as a physics: all of it, its spread, or one difference alone.
"""

from engine.fabrication.as_built.deviation import Deviation, Origin
from engine.fabrication.as_built.deviations import deviations
from engine.fabrication.as_built.twin import Twin, search_physics, twin_of, twin_of_robot

__all__ = ["Deviation", "Origin", "Twin", "deviations", "search_physics", "twin_of", "twin_of_robot"]
