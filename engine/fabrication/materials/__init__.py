"""The materials of a robot: every figure that the simulation does not know.

Here are the properties of materials, bought parts and the printer, and the file that they are read from; what
is computed from them lies elsewhere in ``engine.fabrication``. Read in this order:

- ``sources``: where a number comes from: simulated, measured or assumed.
- ``toml_table``: a TOML table read into a dataclass; each key carries its unit, each value is checked.
- ``properties``: the tables as dataclasses (``CableMaterial``, ``Printer``, ...), together ``Materials``.
- ``materials_file``: reads and checks a whole file, or one of the presets in ``presets/``.
"""

from engine.fabrication.materials.materials_file import (
    PRESETS,
    load_materials,
    parse_materials,
    preset_text,
)
from engine.fabrication.materials.properties import (
    CAP_SLEEVE,
    CAP_TIP,
    CableMaterial,
    Materials,
    Printer,
    ServoMotor,
)
from engine.fabrication.materials.sources import Source, least_certain

__all__ = [
    "CAP_SLEEVE",
    "CAP_TIP",
    "PRESETS",
    "CableMaterial",
    "Materials",
    "Printer",
    "ServoMotor",
    "Source",
    "least_certain",
    "load_materials",
    "parse_materials",
    "preset_text",
]
