"""All files to build a robot from, by their names in its folder."""

from __future__ import annotations

from typing import Final

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.bill_of_materials import bill_of_materials
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.cut_lists import cables, rods
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.dimensions.joints import joints, orientations
from engine.fabrication.dimensions.pull_test import coupon
from engine.fabrication.kit.jig import robot_jig
from engine.fabrication.materials import Materials
from engine.fabrication.parts.assembly import robot_glb
from engine.fabrication.parts.mesh_files import stl_bytes, threemf_bytes
from engine.fabrication.parts.net import module_net, net_name
from engine.fabrication.parts.net_files import coupon_drawing, dxf_bytes, net_drawing, svg_bytes
from engine.fabrication.parts.printed_parts import printed_parts
from engine.files import csv_text

NAME_IN_MODEL: Final = "name_in_robot_xml"
"""Heading of what a cable or rod is called in the model, which counts modules from 0."""


def fabrication_files(
    morphology: Morphology, materials: Materials, feet: tuple[Foot, ...] = ()
) -> dict[str, bytes]:
    """Return name and content of every file to cut, print and buy from; equal robots give equal bytes.

    ``parts/NAME.stl`` and ``parts/NAME.3mf`` (mm), ``net/NAME.dxf`` and ``net/NAME.svg`` (1:1, mm),
    ``robot.glb`` (metres), ``bill_of_materials.csv``, ``cables.csv``, ``rods.csv``, ``joints.csv``, and
    ``feet.csv`` if the robot has some.
    """
    files = {
        "robot.glb": robot_glb(morphology, materials, feet),
        "bill_of_materials.csv": bill_of_materials(morphology, materials, feet).encode(),
        "cables.csv": _cables(morphology, materials),
        "rods.csv": _rods(morphology, materials),
        "joints.csv": _joints(morphology),
    }
    if feet:
        files["feet.csv"] = _feet(feet)
    for part in printed_parts(morphology, materials, feet):
        files[f"parts/{part.name}.stl"] = stl_bytes(part.solid, part.name)
        files[f"parts/{part.name}.3mf"] = threemf_bytes(part.solid, part.name)
    holder = robot_jig(morphology, materials)
    if holder is not None:
        files["parts/jig.stl"] = stl_bytes(holder.solid, "jig")
        files["parts/jig.3mf"] = threemf_bytes(holder.solid, "jig")
    drawings = {}
    for design in {d.level: d for d in design_cables(morphology, materials)}.values():
        drawings[f"net/{net_name(design.level)}"] = net_drawing(module_net(design, materials.printer), design)
    if materials.cable.form == "sheet":
        drawings["net/pull_coupon"] = coupon_drawing(coupon(morphology, materials))
    for name, drawing in drawings.items():
        files[f"{name}.dxf"] = dxf_bytes(drawing)
        files[f"{name}.svg"] = svg_bytes(drawing)
    return files


def _feet(feet: tuple[Foot, ...]) -> bytes:
    header = ["foot", "module", "node", "part", "clock_degrees", "on_ground_percent"]
    header += ["forward_cm", "backward_cm", "off_degrees"]
    rows = [
        [
            *(f.number, t.module_number(f.module), f.node, f.part, f.clock, f"{100 * f.share:.1f}"),
            *(f"{100 * f.forward:.2f}", f"{100 * f.backward:.2f}", f"{f.off:.0f}"),
        ]
        for f in feet
    ]
    return csv_text([header, *rows]).encode()


def _mm(value: float | None, scale: float = 1e3) -> str:
    return "" if value is None else f"{scale * value:.3f}"


def _cables(morphology: Morphology, materials: Materials) -> bytes:
    header = [
        "module",
        "node_a",
        "node_b",
        "assembled_mm",
        "contracted_mm",
        "rest_mm",
        "unstretched_mm",
        "pretension_n",
        "stiffness_n_per_m",
        "area_mm2",
        "square_side_mm",
        "strain_assembled_percent",
        "strain_contracted_percent",
        "producible",
        NAME_IN_MODEL,
    ]
    rows: list[list[object]] = [
        [
            t.module_number(c.module),
            *c.nodes,
            *(_mm(v) for v in (c.assembled, c.contracted, c.rest, c.free)),
            f"{c.pretension:.4f}",
            f"{c.stiffness:.3f}",
            _mm(c.area, 1e6),
            _mm(c.square_side),
            _mm(c.strain_assembled, 100.0),
            _mm(c.strain_contracted, 100.0),
            "yes" if c.producible else "no",
            c.name,
        ]
        for c in cables(morphology, materials)
    ]
    return csv_text([header, *rows]).encode()


def _rods(morphology: Morphology, materials: Materials) -> bytes:
    header = [
        "module",
        "rod",
        "kind",
        "node_a",
        "node_b",
        "length_mm",
        "cut_mm",
        "diameter_mm",
        "simulated_mass_g",
        "cut_mass_g",
        NAME_IN_MODEL,
    ]
    rows: list[list[object]] = [
        [
            t.module_number(r.module),
            t.rod_of(r.nodes[0]),
            r.kind,
            *r.nodes,
            *(_mm(v) for v in (r.length, r.cut, r.diameter, r.simulated_mass, r.cut_mass)),
            r.name,
        ]
        for r in rods(morphology, materials)
    ]
    return csv_text([header, *rows]).encode()


def _joints(morphology: Morphology) -> bytes:
    header = [
        "module",
        "face",
        "next_module",
        "next_face",
        "tie_1",
        "tie_2",
        "tie_3",
        "next_servo_turn_degrees",
    ]
    turns = orientations(morphology)
    rows: list[list[object]] = [
        [
            t.module_number(j.module),
            j.face,
            t.module_number(j.module + 1),
            j.next_face,
            *(f"{a}-{b}" for a, b in j.node_pairs),
            f"{turns[j.module + 1].turn:g}",
        ]
        for j in joints(morphology)
    ]
    return csv_text([header, *rows]).encode()
