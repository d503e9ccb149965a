"""One action per picture: a module is put together, drawn from its GLB scene."""

from __future__ import annotations

import dataclasses
from typing import Final

from reportlab.lib.utils import ImageReader
from reportlab.platypus import Flowable

from engine.body import module as t
from viz.build_sheet import blocks
from viz.build_sheet.kit.scene_pictures import ScenePictures
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.scene import OrthographicCamera
from viz.build_sheet.style import Paper

SIZE: Final = (460, 400)
"""Of a picture, in pixels."""
COLUMNS: Final = 3
CAMERA: Final = OrthographicCamera.looking(-30.0, 25.0)
BENCH: Final = OrthographicCamera.looking(40.0, 20.0)
"""Looks at the servo before it is in the module."""
KNOWN: Final = ("*_rod*", "*_cap_*", "*_cable_*", "*_servo*", "*_mount*", "*_drum*", "jig*")
SERVO: Final = f"*_rod{t.SERVO_ROD}"


@dataclasses.dataclass(frozen=True, slots=True)
class Action:
    """One action.

    Attributes:
        text: what is done.
        new: patterns of the names of the parts that it adds or handles.
        gone: patterns of parts that are taken away.
        close: whether the picture shows only what has been built so far, from the servo's side.
    """

    text: str
    new: tuple[str, ...]
    gone: tuple[str, ...] = ()
    close: bool = False


def actions(scene: ScenePictures) -> list[Action]:
    """Return the actions from the first part to the last; together they add every part of the scene."""
    r0, (a, b) = t.SERVO_ROD, t.RODS[t.SERVO_ROD]
    rest = sorted(set(scene.names) - set(scene.matching(KNOWN)))
    found = [
        # parts that this list does not know belong to the servo
        Action("Servo into the cradle of its mount", ("*_mount*", "*_servo", *rest), close=True),
        Action("Counterweight into its cup", ("*_ballast*",), close=True),
        Action("Drum on the servo's shaft", ("*_drum*",), close=True),
        Action(f"Both pieces of rod {r0} into the mount, the short one at {a}", (SERVO,), close=True),
    ]
    jig = scene.matching(["jig*"])
    unit = tuple(scene.matching([p for action in found for p in action.new]))
    if jig:
        found.append(Action("Jig on the table", ("jig*",), gone=unit))
    into = "into the jig" if jig else "in its place"
    found.append(Action(f"Rod {r0} with the servo {into}: nodes {a} and {b}", unit))
    for r, (a, b) in enumerate(t.RODS):
        if r != r0:
            found.append(Action(f"Rod {r} {into}: nodes {a} and {b}", (f"*_rod{r}",)))
    done: set[int] = set()
    for r, (a, b) in enumerate(t.RODS):
        done |= {a, b}
        cables = [f"*_cable_{p}_{q}" for p, q in t.CABLES if {p, q} <= done and {p, q} & {a, b}]
        found.append(Action(f"Net: {a} and {b} over the ends of rod {r}", (f"*_rod{r}", *cables)))
    for r, (a, b) in enumerate(t.RODS):
        found.append(Action(f"Caps on rod {r}: {a}, then {b}", (f"*_cap_{a}", f"*_cap_{b}")))
    if jig:
        found.append(Action("Out of the jig: pull it straight up", (), gone=("jig*",)))
    found += [
        Action(f"Line from the drum through the guide to node {n}", (f"*_servo_{n}",)) for n in t.SERVO_NODES
    ]
    return found


def pages(scene: ScenePictures, paper: Paper) -> list[Flowable]:
    """Return the section."""
    made = actions(scene)
    width = paper.inner_width / COLUMNS
    there: list[str] = []
    pictures: list[Flowable] = []
    shown = scene.matching(["*"])
    for k, action in enumerate(made, start=1):
        new = scene.matching(action.new)
        gone = set(scene.matching(action.gone))
        there = [name for name in there if name not in gone]
        before = [name for name in there if name not in new]
        if not new:  # for good
            shown = [name for name in shown if name not in gone]
        within = [*before, *new] if action.close else shown
        image = ImageReader(
            scene.picture(
                BENCH if action.close else CAMERA, new, before, size=SIZE, around=scene.points(within)
            )
        )
        pictures.append(_picture(k, action.text, image, width - 6))
        there = [*before, *new]
    return [
        blocks.heading("Picture by picture"),
        blocks.body(
            "One action per picture: what it adds is in colour, what is there already is grey. How each is"
            " done, with its figures, is under “Build one module”; numbers are nodes (rod ends)."
        ),
        blocks.in_rows(pictures, paper.inner_width, 4, COLUMNS),
    ]


def _picture(number: int, text: str, image: ImageReader, width: float) -> Flowable:
    height = width * SIZE[1] / SIZE[0]

    def draw(pen: Pen) -> None:
        pen.canvas.drawImage(image, 0, 26, width, height)
        lines = _lines(f"{number}. {text}")
        for k, line in enumerate(lines):
            pen.text(0, 16 - 10 * k, line, size=8, bold=True)

    return Picture(width, height + 26, draw, f"action {number}")


def _lines(text: str, most: int = 32) -> list[str]:
    """Return a text in lines of so many letters at most."""
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) >= most and lines[-1]:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines
