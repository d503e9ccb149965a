"""The materials file as a form: what to measure, in which order, on the line where it is entered.

The form is a materials file before and after it is filled in: ``export --materials measured.toml`` makes
parts of what was measured.
"""

from __future__ import annotations

import math
import re
from typing import Final

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.pull_test import coupon
from engine.fabrication.materials import Materials
from engine.files import parse_toml

MEASURES: Final = (
    ("cable", "stock_thicknesses_mm", "the sheets' thicknesses: ten layers in the calipers, by ten"),
    ("servo", "body_length_mm", "the case, along its ears, with calipers"),
    ("servo", "body_width_mm", "the case, across"),
    ("servo", "body_height_mm", "the case without the tower of the shaft"),
    ("servo", "ear_height_mm", "from the bottom of the case to the underside of the ears"),
    ("servo", "shaft_diameter_mm", "over the teeth of the shaft"),
    ("servo", "shaft_height_mm", "from the underside of the ears to the end of the shaft"),
    ("servo", "mass_g", "the servo with its horn screw and 25 cm of cable"),
    ("printer", "clearance_mm", "so that a printed cap slides on a rod without force and does not wobble"),
    ("rod", "density_kg_m3", "the mass of a stock rod by its volume"),
    ("plastic", "density_kg_m3", "the mass of a printed cap by the volume that the slicer says"),
    ("line", "linear_density_kg_m", "the mass of 10 m by 10"),
)
"""Table and key of what is measured after the pull test, and how, in that order; those that a file has."""
_HEADER: Final = """\
# A form for one module. It is a materials file: go through it in the order of the numbers, write
# what you measured over what is there, and make the parts of that with
#   tensatlas export RUN --cell I,J --materials measured.toml --out robot/
# 1. Pull test, at the end of this file: pull first, before anything is cut or printed.
"""
_TABLE: Final = re.compile(r"\s*\[+\s*(\w+)\s*\]+")
_EXAMPLE: Final = re.compile(r"(^[ ]*#[ ]*\[pull_test\].*\n)(^[ ]*#.*\n?)*", re.MULTILINE)
"""A pull test that a preset shows as a comment; the form has its own."""
_KEY: Final = re.compile(r"\s*(\w+)\s*=")


def measures(text: str) -> list[tuple[int, str, str, str]]:
    """Return number, table, key and how of what is measured for a materials file, after the pull test."""
    content = parse_toml(text, file="materials")
    there = [m for m in MEASURES if m[1] in content.get(m[0], {})]
    return [(n, *m) for n, m in enumerate(there, start=2)]


def measured_form(
    text: str,
    morphology: Morphology,
    materials: Materials,
    feet_friction: tuple[float, float] | None = None,
) -> str:
    """Return the form for a body.

    Args:
        text: of the materials file.
        morphology: what is built.
        materials: what the file says.
        feet_friction: forward and backward, that the robot's feet are simulated with; None without feet.
    """
    steps = {(table, key): (n, how) for n, table, key, how in measures(text)}
    table, lines = "", []
    for line in _EXAMPLE.sub("", text).splitlines():
        if found := _TABLE.match(line):
            table = found[1]
        key = _KEY.match(line)
        if key and (table, key[1]) in steps:
            n, how = steps[table, key[1]]
            lines.append(f"{line.split('#')[0].rstrip()}  # MEASURE {n}: {how}")
        else:
            lines.append(line)
    form = _HEADER + "\n".join(lines) + "\n"
    if materials.pull_test is None:
        form += _pull_test(morphology, materials)
    if materials.feet_test is None and feet_friction is not None:
        form += _feet_test(feet_friction)
    return form


def _feet_test(friction: tuple[float, float]) -> str:
    """Return the table of the friction test of feet, commented out until it is filled in."""
    n = len(MEASURES) + 2
    forward, backward = (f"{math.degrees(math.atan(f)):.0f}" for f in friction)
    return f"""
# MEASURE {n}: press three feet (parts/foot_090) on parts/friction_sled, notches towards its point, and tilt a
# board with your floor on it until the sled keeps sliding: five times with its point downhill, five times
# uphill. Take the # away from the lines below, and correct them.
# [feet_test]
# forward_degrees = [{forward}, {forward}]  # MEASURE {n}: angles, point downhill
# backward_degrees = [{backward}, {backward}]  # MEASURE {n}: angles, point uphill
"""


def _pull_test(morphology: Morphology, materials: Materials) -> str:
    """Return the table of the pull test, commented out until it is filled in."""
    c = coupon(morphology, materials)
    where = "parts/pull_coupon, printed" if materials.cable.form == "printed" else "net/pull_coupon, cut"
    most = f"{100 * materials.cable.max_strain:.0f}"
    return f"""
# MEASURE 1: {where}. Hang {1000 * c.expected_mass:.0f} g on it, wait a minute, measure how much longer it
# became, take the # away from the lines below, and correct them. Expected: {1000 * c.extension:.1f} mm.
# [pull_test]
# length_mm = {1000 * c.gauge_length:.1f}  # MEASURE 1: free length before pulling
# area_mm2 = {1e6 * c.area:.3f}  # MEASURE 1: cross-section before pulling
# force_n = {c.expected_force:.3f}  # MEASURE 1: mass in kg times 9.81
# extension_mm = {1000 * c.extension:.2f}  # MEASURE 1: how much longer it became
# max_strain_percent = {most}  # MEASURE 1: largest strain from which it sprang back
"""
