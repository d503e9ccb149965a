"""The cut list and the cable material: lengths, sections, tensions, and the pull test."""

from __future__ import annotations

from reportlab.platypus import Flowable

from engine.body import module as t
from engine.fabrication.dimensions.cables import CableDesign, design_cables, section_source
from engine.fabrication.dimensions.cut_lists import rods, stock_plan
from engine.fabrication.dimensions.pull_test import coupon
from engine.fabrication.materials import Materials
from engine.fabrication.parts.servo_parts import half_rods
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.style import Paper


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    width = paper.inner_width
    return [
        blocks.together(
            [blocks.heading("Cut list"), blocks.subheading("Rods"), _rods(facts, materials, width)]
        ),
        *_cables(facts, materials, width),
    ]


def _rods(facts: Facts, materials: Materials, width: float) -> Flowable:
    every = rods(facts.morphology, materials)
    n = facts.morphology.n_modules
    rows = []
    for r in range(len(t.RODS)):
        rod = every[r]
        rows.append(
            [
                f"rod {r}" + (" (servo)" if rod.kind == "servo" else ""),
                f"{rod.nodes[0]} – {rod.nodes[1]}",
                str(n),
                f"<b>{1000 * rod.cut:.1f}</b>",
                f"{1000 * rod.length:.1f}",
                f"{1000 * rod.diameter:.1f}",
                f"{1000 * rod.cut_mass:.2f}",
            ]
        )
    header = (
        "in every module",
        "nodes",
        "pieces",
        "cut to (mm)",
        "node to node (mm)",
        "diameter (mm)",
        "mass of the piece (g)",
    )
    plan = stock_plan(facts.morphology, materials)
    text = (
        f"The stock of {1000 * materials.rod.stock_length:g} mm is shorter than a piece: buy longer rods."
        if plan is None
        else f"{plan.pieces} pieces in all: a rod of {1000 * plan.stock_length:g} mm gives"
        f" {plan.pieces_per_stock}, saw cuts of {1000 * materials.rod.kerf:g} mm included; order"
        f" {plan.stock_rods}."
    )
    table = blocks.grid(
        header, rows, blocks.columns(width, 18, 11, 10, 14, 16, 14, 17), right=(2, 3, 4, 5, 6)
    )
    text += " A piece is shorter than its rod because the printed caps reach beyond it to the nodes."
    left, right = half_rods(materials)
    a, b = t.RODS[t.SERVO_ROD]
    text += (
        f" <b>Cut rod {t.SERVO_ROD} again</b>, into {1000 * left:.1f} mm at node {a} and"
        f" {1000 * right:.1f} mm at node {b}; the rest is not used:"
        " the servo's mount is between the two."
    )
    return blocks.together(
        [table, blocks.gap(2), blocks.note(f"{style.escaped(materials.rod.material)}. {text}")]
    )


def _cables(facts: Facts, materials: Materials, width: float) -> list[Flowable]:
    designs = design_cables(facts.morphology, materials)
    parts: list[Flowable] = [
        blocks.subheading("Passive cables: how they are made"),
        _designs(designs, materials, width),
        blocks.note(
            f"Material: {style.escaped(materials.cable.material)}, secant modulus"
            f" {materials.cable.modulus / 1e6:g} MPa at {100 * materials.cable.modulus_strain:.0f} %, springs"
            f" back up to {100 * materials.cable.max_strain:.0f} % ({materials.cable_source}). Rubber pulls"
            " less and less the further it is stretched, unlike the simulated spring: unstretched length and"
            " section are those with which it has the simulated tension and stiffness in the finished module,"
            f" a day later, when the material has given way by"
            f" {100 * materials.cable.relaxation_after_a_day:.0f} %. The file tables/cables.csv lists all."
        ),
    ]
    return [*parts, blocks.together(_pull_test(facts, materials))]


def _designs(designs: tuple[CableDesign, ...], materials: Materials, width: float) -> Flowable:
    rows: list[list[str]] = []
    marked: list[int] = []
    for level in dict.fromkeys(d.level for d in designs):
        alike = [d for d in designs if d.level == level]
        d = alike[0]
        if not d.works:
            marked.append(len(rows))
        rows.append(
            [
                style.module_names([a.module for a in alike]),
                f"{d.stiffness:.2f}",
                f"{d.tension:.3f}",
                f"{1000 * d.free:.2f}",
                f"{1e6 * d.area:.3f}",
                f"{1000 * d.section.width:.2f} × {1000 * d.section.thickness:.2f}",
                f"{100 * d.strain_assembled:.0f} / {100 * d.strain_contracted:.0f}",
                "yes" if d.producible else "<b>no</b>",
            ]
        )
    header = (
        "modules",
        "k (N/m)",
        "tension (N)",
        "loose (mm)",
        "area (mm²)",
        "width × thickness (mm)",
        "strain, built / contracted (%)",
        "can be made",
    )
    shares = (12, 10, 10, 12, 10, 18, 18, 10)
    table = blocks.grid(header, rows, blocks.columns(width, *shares), right=(1, 2, 3, 4), marked=marked)
    source = f"Stiffness {designs[0].stiffness_source}, section {section_source(materials)}."
    return blocks.together([table, blocks.gap(2), blocks.note(source)])


def _pull_test(facts: Facts, materials: Materials) -> list[Flowable]:
    c = coupon(facts.morphology, materials)
    make = (
        "Print the coupon (parts/pull_coupon.stl) flat, with the cables' settings"
        if materials.cable.form == "printed"
        else f"Cut the coupon (net/pull_coupon.dxf) from the sheet of {1000 * c.thickness:g} mm"
    )
    piece = (
        f"{make}: {1000 * c.width:.2f} × {1000 * c.thickness:.2f} mm, and draw two marks"
        f" {1000 * c.gauge_length:.0f} mm apart at the ends of the narrow strip."
    )
    measured = (
        "The modulus used here was measured so."
        if materials.pull_test
        else "The modulus used here is assumed: <b>pull before you make all the cables.</b>"
    )
    return [
        blocks.subheading("Pull test of the cable material"),
        blocks.body(
            f"{measured} {piece} Hang it up, load it until the marks are"
            f" {1000 * (c.gauge_length + c.extension):.0f} mm apart, and wait a minute. That should take"
            f" <b>{c.expected_force:.2f} N</b>, the weight of {1000 * c.expected_mass:.0f} g. Write what you"
            " found into the table [pull_test] of the materials file (length, area, force, extension, and the"
            " largest strain from which it springs back) and export again with --materials and that file: all"
            " sections on this sheet then follow from it."
        ),
    ]
