"""The first page: which robot this is, how it looks, and how to use the sheet."""

from __future__ import annotations

import re

import numpy as np
import segno
from reportlab.lib.colors import HexColor, white
from reportlab.platypus import Flowable, Paragraph

from engine.body import module as t
from engine.fabrication.buildability import problems
from engine.fabrication.materials import Materials
from viz.build_sheet import blocks, style
from viz.build_sheet.bodies import robot
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.scene import OrthographicCamera, SceneView, paint
from viz.build_sheet.style import Paper, signed

QR_SIZE = 92.0
VIEW_HEIGHT = 172.0
SHADOW = HexColor("#e4e8ec")


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the first page."""
    width = paper.inner_width
    n = facts.morphology.n_modules
    summary = facts.task.summary or f"task {facts.task.name}"
    left: list[Flowable] = [
        Paragraph(style.escaped(f"{facts.name} of {facts.run_name}"), style.TITLE),
        blocks.gap(2),
        blocks.body(
            f"A soft robot of <b>{n} tensegrity modules</b> in a chain, {_grams(facts.mass)} g, evolved in"
            f" simulation to {style.escaped(summary)}. To steer to a target it needs something beside it that"
            " sees where it is (see “What the controller does”)."
        ),
    ]
    qr = Picture(QR_SIZE, QR_SIZE, lambda pen: _draw_qr(pen, qr_text(facts)), "QR code")
    block = blocks.beside(left, qr, [width - QR_SIZE - 10, QR_SIZE + 10])
    view = Picture(width, VIEW_HEIGHT, lambda pen: _draw_view(pen, facts), "rendered view")
    return [
        block,
        blocks.gap(4),
        *verdict(facts, materials),
        _identity(facts, materials, width),
        blocks.gap(4),
        view,
        _legend(width),
        blocks.gap(2),
        *_how_to(facts),
    ]


def verdict(facts: Facts, materials: Materials) -> list[Flowable]:
    """Return whether the robot can be built and is worth it; in red if it is not."""
    found: list[Flowable] = []
    wrong = problems(facts.morphology, materials)
    for problem in wrong:
        where = style.module_names(problem.modules)
        cure = style.escaped(problem.proposals[0])
        found.append(
            blocks.warning(
                f"<b>Cannot be built so</b> (modules {where}): {style.escaped(problem.text)} {cure}."
            )
        )
    if materials.instead:
        found.append(blocks.body(f"<b>{style.escaped(materials.instead)}</b>"))
    twin, scores = facts.twin, facts.as_built
    if twin is not None and scores is not None:
        names = {d.key: (d.name, d.remedy) for d in twin.deviations}
        said = [style.escaped(s) for s in scores.sentences(names)]
        said[0] = f"<b>{said[0]}</b>"
        text = re.sub(r"(?<= )-(?=\d)", "−", " ".join(said))
        found.append(blocks.body(text) if scores.worth_building else blocks.warning(text))
    if not wrong and (scores is None or scores.worth_building):
        found.append(
            blocks.body("This sheet and the folder that it came in say all that is needed to build it.")
        )
    return found


def qr_text(facts: Facts) -> str:
    """Return what the QR code says: the robot's id, its run and cell, and its address in the explorer."""
    robot = f"TensAtlas robot {facts.evaluation.solution.number}, id {facts.robot_id}"
    return f"{robot}\nrun {facts.run_name}\n{facts.where}\n{facts.link}"


def _identity(facts: Facts, materials: Materials, width: float) -> Flowable:
    length, breadth, height = (100.0 * v for v in facts.size)
    n = facts.morphology.n_modules
    where = facts.place.name if facts.place else "-"
    head = f"module {t.module_number(facts.head.module)}"
    rows = [
        ("Robot", f"<b>{facts.number}</b>", "Made of", style.escaped(materials.name)),
        ("Run", style.escaped(facts.run_name), "Modules", f"{n}, numbered from 1 to {n}"),
        ("Archive and cell", style.escaped(where), "Head (goes first)", head),
        ("Id in all runs", facts.robot_id, "Cable stiffness", _stiffness(facts)),
        (
            "Task",
            style.escaped(facts.task.name),
            "Size, settled",
            f"{length:.1f} × {breadth:.1f} × {height:.1f} cm",
        ),
        ("Date of the run", facts.date, "Mass, simulated", f"{_grams(facts.mass)} g"),
        (
            "Made with",
            f"TensAtlas {style.escaped(facts.versions.get('tensatlas', '?'))}, MuJoCo"
            f" {style.escaped(facts.versions.get('mujoco', '?'))}",
            "Comes closer by",
            f"<b>{signed(100 * facts.f_s, 1)} cm</b> in {facts.config.trials.trial_time:g} s, simulated",
        ),
    ]
    cells = [[f"<b>{a}</b>", b, f"<b>{c}</b>", d] for a, b, c, d in rows]
    table = blocks.grid((), cells, blocks.columns(width, 20, 30, 20, 30))
    code = facts.robot_hash
    line = blocks.note(
        f"SHA-256 of genotypes, task and physics: {code[:32]} {code[32:]}. The QR code holds id, run, cell"
        " and the robot's address in the explorer."
    )
    return blocks.together([table, blocks.gap(2), line])


def _stiffness(facts: Facts) -> str:
    body = facts.morphology
    if body.stiffness_mode == "shared":
        return f"{body.stiffness_text} = {t.stiffness_n_per_m(body.stiffness):.2f} N/m"
    return f"{body.stiffness_text} × {t.CABLE_STIFFNESS:g} N/m, module 1 first"


def _how_to(facts: Facts) -> list[Flowable]:
    n = facts.morphology.n_modules
    steps = [
        "<b>Check the print.</b> The bar below must be exactly 50 mm long. If not, print again at 100 %. Read"
        " “Safety”.",
        "<b>Order and print</b> what the two lists say, the test pieces first. Do the pull test of the cable"
        " material before you make the cables.",
        "<b>Wire and program</b> the board on the bench and set the pulses of every servo (“Program”): the"
        " assembly needs a servo that stands at 0°.",
        "<b>Build module 1</b> by the steps with pictures and measure it (step 8). Nobody has built this"
        f" robot before: go on to module{'s' if n > 2 else ''} {'2' if n == 2 else f'2 to {n}'} only when"
        " it is right. Label every module.",
        "<b>Join them</b> by the orientation table: which node meets which. Another pairing is another"
        " robot.",
        *_put_on_feet(facts),
        "<b>Run the checks</b>, and only then let it crawl.",
    ]
    return [
        blocks.subheading("How to use this sheet"),
        *blocks.bullets(steps, numbered=True),
        Picture(220, 20, _draw_bar, "scale bar"),
    ]


def _put_on_feet(facts: Facts) -> list[str]:
    n = len(facts.feet.feet)
    return (
        [f"<b>Put its {n} feet on</b>, each turned as its table says, after the friction test."] if n else []
    )


def _legend(width: float) -> Picture:
    items = (
        (style.ROD, "plain rod"),
        (style.HEAD, "rod of the head module"),
        (style.SERVO, "servo rod; guide (ball)"),
        (style.CABLE, "passive cable"),
        (style.SERVO_CABLE, "internal cable, pulled by the servo"),
        (style.LINK, "link between modules"),
    )

    def draw(pen: Pen) -> None:
        for k, (color, text) in enumerate(items):
            x, y = k % 3 * width / 3, pen.height - 10 - 12 * (k // 3)
            pen.line((x, y + 2.5), (x + 12, y + 2.5), color=color, width=3)
            pen.text(x + 16, y, text)

    return Picture(width, 26, draw, "legend")


def _draw_bar(pen: Pen) -> None:
    length = 50 * 72 / 25.4
    pen.box(0, 6, length, 5, fill=white)
    for k in range(0, 5, 2):
        pen.box(k * length / 5, 6, length / 5, 5, fill=style.INK)
    pen.text(length + 6, 6, "50 mm", size=8)


def _draw_qr(pen: Pen, text: str) -> None:
    rows = list(segno.make(text, error="m", micro=False, boost_error=False).matrix_iter(border=2))
    side = pen.width / len(rows)
    pen.canvas.setFillColor(style.INK)
    for y, row in enumerate(rows):
        for x, dark in enumerate(row):
            if dark:
                # a hair larger, so that no white lines appear between the squares
                pen.canvas.rect(
                    x * side, pen.height - (y + 1) * side, side + 0.05, side + 0.05, stroke=0, fill=1
                )


def _draw_view(pen: Pen, facts: Facts) -> None:
    body = facts.levelled
    camera = OrthographicCamera.looking(-22, 26)
    points = body.nodes.reshape(-1, 3)
    ground = points * np.array([1.0, 1.0, 0.0])
    box = (12, 12, pen.width - 24, pen.height - 42)
    view = SceneView.fitting(camera, np.concatenate([points, ground]), box, largest=1450)
    shadow = max(4 * t.ROD_RADIUS * view.scale, 1.0)
    for start, end in body.rods.reshape(-1, 2, 3) * (1, 1, 0):
        pen.line(view.at(start), view.at(end), color=SHADOW, width=shadow, cap=1)
    paint(pen, view, robot(facts))
    for i in range(body.n_modules):
        top = body.nodes[i][np.argmax(body.nodes[i] @ camera.up)]
        centre = view.at(body.nodes[i].mean(axis=0))
        x, y = centre[0], view.at(top)[1] + 7
        number = t.module_number(i)
        pen.text(
            x,
            y,
            f"HEAD · {number}" if i == facts.head.module else str(number),
            align="centre",
            bold=True,
            size=9,
            color=style.ACCENT if i == facts.head.module else style.INK,
        )


def _grams(kilograms: float) -> str:
    return f"{1000 * kilograms:.1f}"
