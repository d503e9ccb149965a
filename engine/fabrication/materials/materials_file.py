"""A materials file: the TOML that says what a robot is built from. Three presets ship with the project.

Keys carry their unit (``modulus_mpa``, ``length_mm``). Every key of a table is required and no other is
allowed, so that a file says everything that the build sheet prints; ``[pull_test]`` and ``[feet_test]`` may
be left out. ``docs/fabrication.md`` explains each key.
"""

from __future__ import annotations

import dataclasses
import importlib.resources
import math
from pathlib import Path
from typing import Final, get_args

from engine.body import module as t
from engine.errors import InvalidData
from engine.fabrication.materials.properties import (
    CAP_TIP,
    BoughtPart,
    CableForm,
    CableMaterial,
    Fastener,
    FeetTest,
    Line,
    Materials,
    Plastic,
    Printer,
    PullTest,
    RodStock,
    ServoMotor,
)
from engine.fabrication.materials.toml_table import read_table, text_value
from engine.files import parse_toml
from engine.simulation.physics import MOST_FRICTION

PRESETS: Final = ("latex-sheet", "tpu-85a", "silicone-sheet")
"""Names of the materials files that ship with the project; the first is the default."""
SHAFT: Final = (0.0015, 0.0075)
"""Least and largest height of a servo's shaft over its case in m: drum and screw must hold on it."""
MODULI: Final = (5e4, 1e9)
"""Least and largest modulus in Pa that a pull test may give: softer than foam rubber, stiffer than nylon."""

_TABLES: Final[dict[str, type]] = {
    "cable": CableMaterial,
    "printer": Printer,
    "rod": RodStock,
    "plastic": Plastic,
    "servo": ServoMotor,
    "line": Line,
    "board": BoughtPart,
    "battery": BoughtPart,
}


def load_materials(source: str | Path = PRESETS[0]) -> Materials:
    """Read a preset by its name or a materials file by its path.

    Raises:
        InvalidData: the file cannot be read, is not TOML, or holds an invalid value.
    """
    path = Path(source)
    if str(source) in PRESETS:
        text = preset_text(str(source))
    else:
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as e:
            reason = e.strerror if isinstance(e, OSError) else "it is not UTF-8 text"
            raise InvalidData(
                f"materials file {source} cannot be read: {reason}; presets are {', '.join(PRESETS)}"
            ) from None
    return parse_materials(text, file=str(source))


def preset_text(name: str) -> str:
    """Return the text of a preset, to be copied and edited."""
    return (importlib.resources.files(__package__) / "presets" / f"{name}.toml").read_text("utf-8")


def parse_materials(text: str, *, file: str) -> Materials:
    """Read materials from TOML text; ``file`` names it in messages.

    Raises:
        InvalidData: as for ``load_materials``.
    """
    content = parse_toml(text, file=file)
    allowed = {"name", "fastener", "pull_test", "feet_test", *_TABLES}
    for key in content:
        if key not in allowed:
            raise InvalidData(f"{file}: unknown key {key}; known are {', '.join(sorted(allowed))}")
    for key in ("name", "fastener", *_TABLES):
        if key not in content:
            raise InvalidData(f"{file}: {key} is missing")
    tables = {key: read_table(kind, content[key], f"{file}: {key}") for key, kind in _TABLES.items()}
    _check_cable(tables["cable"], file)
    if tables["servo"].pulse_max <= tables["servo"].pulse_min:
        raise InvalidData(f"{file}: servo.pulse_max_us must be more than servo.pulse_min_us")
    _check_shaft(tables["servo"], file)
    cut = t.ROD_LENGTH - 2 * CAP_TIP
    if tables["rod"].stock_length < cut:
        raise InvalidData(f"{file}: rod.stock_length_mm must be at least {1e3 * cut:g}, the length of a rod")
    if (tables["rod"].bore or 0.0) >= 2 * t.ROD_RADIUS:
        raise InvalidData(f"{file}: rod.bore_mm must be less than {2e3 * t.ROD_RADIUS:g}, the rod's diameter")
    if not isinstance(content["fastener"], list):
        raise InvalidData(f"{file}: fastener must be a list of tables: [[fastener]]")
    fasteners = tuple(
        read_table(Fastener, item, f"{file}: fastener[{i}]") for i, item in enumerate(content["fastener"])
    )
    pull_test = None
    if "pull_test" in content:
        pull_test = read_table(PullTest, content["pull_test"], f"{file}: pull_test")
        if not MODULI[0] <= pull_test.modulus <= MODULI[1]:
            raise InvalidData(
                f"{file}: pull_test gives a modulus of {1e-6 * pull_test.modulus:.3g} MPa, and no cable has"
                f" less than {1e-6 * MODULI[0]:g} or more than {1e-6 * MODULI[1]:g}: check its figures"
            )
        tables["cable"] = dataclasses.replace(
            tables["cable"],
            modulus=pull_test.modulus,
            modulus_strain=pull_test.strain,
            max_strain=pull_test.max_strain,
        )
    feet_test = None
    if "feet_test" in content:
        feet_test = read_table(FeetTest, content["feet_test"], f"{file}: feet_test")
        _check_feet(feet_test, file)
    return Materials(
        name=text_value(content["name"], f"{file}: name"),
        file=file,
        fasteners=fasteners,
        pull_test=pull_test,
        feet_test=feet_test,
        **tables,
    )


def _check_shaft(servo: ServoMotor, file: str) -> None:
    stands = servo.ear_height + servo.shaft_height - servo.body_height
    low, high = SHAFT
    if not low - 1e-9 <= stands <= high + 1e-9:
        raise InvalidData(
            f"{file}: servo: the shaft must stand {1e3 * low:g} to {1e3 * high:g} mm above the case for the"
            " drum"
            f" to hold on it: ear_height_mm + shaft_height_mm - body_height_mm, which is {1e3 * stands:.1f}"
        )


def _check_feet(test: FeetTest, file: str) -> None:
    steepest = math.degrees(math.atan(MOST_FRICTION))
    for key, angles in (("forward", test.forward), ("backward", test.backward)):
        if len(angles) < 2:
            raise InvalidData(
                f"{file}: feet_test.{key}_degrees must hold at least two angles, measured one after the other"
            )
        if max(angles) > steepest:
            raise InvalidData(
                f"{file}: feet_test.{key}_degrees must be at most {steepest:.1f}, which is friction"
                f" {MOST_FRICTION:g}, not {max(angles):g}"
            )
    forward, backward = test.friction
    if backward < forward:
        raise InvalidData(
            f"{file}: feet_test must hold backward at least as well as forward; friction forward is"
            f" {forward:.2f}, backward {backward:.2f}: is the sled's point downhill in forward_degrees?"
        )


def _check_cable(cable: CableMaterial, file: str) -> None:
    if cable.form not in get_args(CableForm):
        raise InvalidData(f"{file}: cable.form must be sheet or printed, not {cable.form!r}")
    if cable.form == "sheet" and not cable.stock_thicknesses:
        raise InvalidData(f"{file}: cable.stock_thicknesses_mm must name the sheets that can be bought")
    if list(cable.stock_thicknesses) != sorted(set(cable.stock_thicknesses)):
        raise InvalidData(f"{file}: cable.stock_thicknesses_mm must increase")
