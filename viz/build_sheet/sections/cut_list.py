"""The cut list and the cable material: lengths, sections, tensions, and the pull test."""

from __future__ import annotations

from reportlab.platypus import Flowable

from engine.body import module as t
from engine.fabrication.dimensions.cables import CableDesign, design_cables, section_source
from engine.fabrication.dimensions.cut_lists import Cable, cables, rods, stock_plan
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
    every = cables(facts.morphology, materials)
    parts: list[Flowable] = [
        blocks.subheading("Passive cables: how they are made"),
        _designs(designs, materials, width),
        blocks.note(
            f"Material: {style.escaped(materials.cable.material)}, secant modulus"
            f" {materials.cable.modulus / 1e6:g} MPa, springs back up to"
            f" {100 * materials.cable.max_strain:.0f} % ({materials.cable_source}). The section follows from"
            " stiffness k, free length L and modulus E: A = k L / E, E less"
            f" {100 * materials.cable.relaxation_after_a_day:.0f} %, by which the material gives way in a"
            " day. At both ends a cable goes on along its"
            " rod by the stated tail, which is part of the spring; the rest length is that between the rods'"
            " ends."
        ),
    ]
    for level in dict.fromkeys(facts.morphology.stiffness_levels):
        modules = [d.module for d in designs if d.level == level]
        chosen = [c for c in every if c.module == modules[0]]
        parts += _cable_table(chosen, modules, materials, width)
    return [*parts, blocks.together(_pull_test(facts, materials))]


def _designs(designs: tuple[CableDesign, ...], materials: Materials, width: float) -> Flowable:
    rows: list[list[str]] = []
    marked: list[int] = []
    for level in dict.fromkeys(d.level for d in designs):
        alike = [d for d in designs if d.level == level]
        d = alike[0]
        section = (
            f"cord Ø {1000 * d.section.width:.2f}"
            if d.section.round
            else f"{1000 * d.section.width:.2f} wide × {1000 * d.section.thickness:.2f} high"
        )
        if not d.works:
            marked.append(len(rows))
        rows.append(
            [
                style.module_names([a.module for a in alike]),
                f"{d.stiffness:.2f}",
                f"{1000 * d.rest:.2f}",
                f"{1000 * d.tail:.1f}",
                f"{1e6 * d.area:.3f}",
                f"{1000 * d.square_side:.2f} / Ø {1000 * d.round_diameter:.2f}",
                section,
                f"{100 * d.strain_assembled:.0f} / {100 * d.strain_contracted:.0f}",
                "yes" if d.producible else "<b>no</b>",
            ]
        )
    header = (
        "modules",
        "k (N/m)",
        "rest length (mm)",
        "tail (mm)",
        "area (mm²)",
        "square / round (mm)",
        "make it (mm)",
        "strain, built / contracted (%)",
        "can be made",
    )
    shares = (11, 9, 9, 8, 9, 15, 16, 14, 9)
    table = blocks.grid(header, rows, blocks.columns(width, *shares), right=(1, 2, 3, 4), marked=marked)
    source = f"Stiffness {designs[0].stiffness_source}, section {section_source(materials)}."
    return blocks.together([table, blocks.gap(2), blocks.note(source)])


def _cable_table(
    chosen: list[Cable], modules: list[int], materials: Materials, width: float
) -> list[Flowable]:
    cord = materials.cable.form == "cord"
    rows = []
    for c in chosen:
        a, b = c.nodes
        rows.append(
            [
                f"{a} – {b}",
                f"{1000 * c.assembled:.2f}",
                f"{1000 * c.rest:.2f}",
                *([f"<b>{1000 * c.cut:.0f}</b>"] if c.cut is not None else []),
                f"{c.pretension:.3f}",
                f"{c.stiffness:.{1 if cord else 2}f}",
                *([] if cord else [f"{1e6 * c.area:.3f}"]),
            ]
        )
    half = (len(rows) + 1) // 2
    pairs = [[*rows[k], *rows[k + half]] for k in range(half)]
    header = ["nodes", "built (mm)", "rest (mm)", *(["cut (mm)"] if cord else []), "tension (N)"]
    header += ["k (N/m)", *([] if cord else ["area (mm²)"])]
    shares = [9.5, 8.5, 8.5, 8.5, 11, 9] if cord else [8, 8, 8, 9, 8, 8]
    right = [k for k in range(2 * len(header)) if k % len(header)]
    table = blocks.grid(header * 2, pairs, blocks.columns(width, *shares, *shares), right=right)
    where = style.module_names(modules)
    title = (
        f"Passive cables of module {where}"
        if len(modules) == 1
        else f"Passive cables of modules {where}, each"
    )
    return [
        blocks.together(
            [
                blocks.subheading(title),
                table,
                blocks.gap(2),
                blocks.note(
                    "Between the rods' ends: built = in the finished module without load, servo off; rest ="
                    " where the cable begins to pull; tension = in the finished module. The file"
                    " tables/cables.csv lists every cable of every module."
                ),
            ]
        )
    ]


def _pull_test(facts: Facts, materials: Materials) -> list[Flowable]:
    c = coupon(facts.morphology, materials)
    piece = (
        f"Print the coupon (parts/pull_coupon.stl) flat, with the cables' settings: {1000 * c.width:.2f} ×"
        f" {1000 * c.thickness:.2f} mm, and draw two marks {1000 * c.gauge_length:.0f} mm apart at the ends"
        " of the narrow strip."
        if c.grip_length
        else f"Take a piece of the cord with two marks {1000 * c.gauge_length:.0f} mm apart."
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
