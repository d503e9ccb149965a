"""The controller as an Arduino sketch, and what it says to a host and without one.

A microcontroller gets what the simulation computes at every control update: the network, the choice of a
frequency and a phase for each module, and the servo command that follows from them and the time. A host, for
example ``tensatlas drive``, tells it over the serial line what the robot senses; without one it plays a gait
that was recorded in simulation.

The templates are in ``engine/data/firmware``; ``@name@`` stands for a value. Read in this order:

- ``protocol``: the lines between a host and the board.
- ``gaits``: what the modules chose in the simulated trials.
- ``sketch``: the files of the sketch.
- ``host_board``: the sketch compiled for this computer, with a stand-in for Arduino's headers.
"""

from engine.fabrication.firmware.sketch import (
    CONTRACTED_PULSE,
    RELEASED_PULSE,
    SKETCH,
    START_PIN,
    fill_in,
    firmware_files,
    pin_map,
)

__all__ = [
    "CONTRACTED_PULSE",
    "RELEASED_PULSE",
    "SKETCH",
    "START_PIN",
    "fill_in",
    "firmware_files",
    "pin_map",
]
