"""One action per picture: a module is put together, drawn from its GLB scene."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np
from reportlab.lib.utils import ImageReader
from reportlab.platypus import Flowable

from engine.body import module as t
from viz.build_sheet import blocks
from viz.build_sheet.kit.scene_pictures import ScenePictures, on_picture
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.scene import OrthographicCamera
from viz.build_sheet.style import Paper

SIZE: Final = (640, 500)
"""Of a picture, in pixels."""
COLUMNS: Final = 2
CAMERA: Final = OrthographicCamera.looking(-30.0, 25.0)
BEHIND: Final = OrthographicCamera.looking(150.0, 25.0)
"""Takes the picture of what is hidden from the usual one."""
HIDDEN: Final = 20
"""Fewest pixels of what is new that the usual camera must see on a small picture."""
BENCH: Final = tuple(
    OrthographicCamera.looking(azimuth, elevation)
    for elevation in (20.0, 50.0)
    for azimuth in (40, 130, 220, 310)
)
"""Look at the servo; the one that sees most of what is new takes the picture."""
KNOWN: Final = (
    "*_rod*",
    "*_cap_*",
    "*_cable_*",
    "*_servo*",
    "*_way_*",
    "*_mount*",
    "*_drum*",
    "*_ballast*",
    "jig*",
)
SERVO: Final = f"*_rod{t.SERVO_ROD}"


@dataclasses.dataclass(frozen=True, slots=True)
class Action:
    """One action.

    Attributes:
        text: what is done.
        new: patterns of the names of the parts that it adds or handles.
        gone: patterns of parts that are taken away.
        close: patterns of the parts that the picture shows large; none for the whole module.
        nodes: that are numbered on the picture.
    """

    text: str
    new: tuple[str, ...]
    gone: tuple[str, ...] = ()
    close: tuple[str, ...] = ()
    nodes: tuple[int, ...] = ()

    @property
    def caps(self) -> bool:
        """Whether it adds caps, which are small."""
        return any("_cap_" in name for name in self.new)


def actions(scene: ScenePictures, *, limited: bool) -> list[Action]:
    """Return the actions from the first part to the last; together they add every part of the scene.

    Args:
        scene: the module, in its jig if it has one.
        limited: whether its rods hold limiters.
    """
    r0, (a, b) = t.SERVO_ROD, t.RODS[t.SERVO_ROD]
    rest = tuple(sorted(set(scene.names) - set(scene.matching(KNOWN))))
    # parts that the list does not know belong to the servo
    bench = ("*_mount*", "*_servo", *rest)
    found = [
        Action("Servo into the cradle of its mount: glue it", bench, close=bench),
        Action("Counterweight into its cup: glue it", ("*_ballast*",), close=bench),
        Action("Servo at a0: drum on its shaft, screw it on", ("*_drum*",), close=(*bench, "*_drum*")),
        Action(
            f"Both pieces of rod {r0} into the mount, the short one at {a}",
            (SERVO,),
            close=(SERVO,),
            nodes=(a, b),
        ),
    ]
    jig = scene.matching(["jig*"])
    unit = tuple(scene.matching([p for action in found for p in action.new]))
    plain = tuple(r for r in range(len(t.RODS)) if r != r0)
    if jig:
        found.append(Action("Jig on the table", ("jig*",), gone=unit))
    into = "into the jig" if jig else "in its place"
    holding = ", its limiter inside," if limited else ""
    found.append(Action(f"Rod {r0} with the servo {into}: nodes {_both((a, b))}", unit, nodes=(a, b)))
    for r in plain:
        text = f"Rod {r}{holding} {into}: nodes {_both(t.RODS[r])}"
        found.append(Action(text, (f"*_rod{r}",), nodes=t.RODS[r]))
    late = list(range(2 * len(t.RODS)))
    if limited:
        for n in sorted(t.SERVO_NODES):
            text = f"Cap on node {n}, the limiter's line out of its slanting hole; bead on the line"
            found.append(Action(text, (f"*_cap_{n}",), nodes=(n,)))
            late.remove(n)
        caps = tuple(f"*_cap_{n}" for n in sorted(t.SERVO_NODES))
        found.append(Action("Adjust the five limiters with a weight, wedge them", caps, nodes=t.SERVO_NODES))
    for ends in t.RODS:
        on = tuple(n for n in ends if n in late)
        text = f"Cap{'s' if len(on) > 1 else ''} on {_both(on)}"
        found.append(Action(text, tuple(f"*_cap_{n}" for n in on), nodes=on))
    done: set[int] = set()
    for r, ends in enumerate(t.RODS):
        done |= {*ends}
        cables = [f"*_cable_{p}_{q}" for p, q in t.CABLES if {p, q} <= done and {p, q} & {*ends}]
        text = f"Net: the rings of {_both(ends)} over the knobs of rod {r}"
        found.append(Action(text, (*(f"*_cap_{n}" for n in ends), *cables), nodes=ends))
    if jig:
        found.append(Action("Out of the jig: pull it straight up", (), gone=("jig*",)))
    for n in t.SERVO_NODES:
        text = f"Line: from its groove into the arm, out of the ball, to node {n}"
        new = (f"*_way_{n}", f"*_servo_{n}")
        found.append(Action(text, new, close=("*_drum*", *bench, *new), nodes=(n,)))
    return found


def pages(scene: ScenePictures, paper: Paper, *, limited: bool) -> list[Flowable]:
    """Return the section; arguments as for ``actions``."""
    made = actions(scene, limited=limited)
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
        around = scene.points(scene.matching(action.close) if action.close else shown)
        camera = camera_for(scene, action, before, around)
        image = ImageReader(scene.picture(camera, new, before, size=SIZE, around=around))
        text = f"{k}. {action.text}" + (" (seen from behind)" if camera is BEHIND else "")
        pictures.append(_picture(text, action, scene, (camera, around), image, width - 8))
        there = [*before, *new]
    return [
        blocks.heading("Picture by picture"),
        blocks.body(
            "One action per picture: what it adds is in colour, what is there already is grey. How each is"
            " done, with its figures, is under “Build one module”; numbers are nodes (rod ends)."
        ),
        blocks.in_rows(pictures, paper.inner_width, 4, COLUMNS),
    ]


def camera_for(
    scene: ScenePictures, action: Action, there: list[str], around: np.ndarray
) -> OrthographicCamera:
    """Return the camera that sees what an action adds: every pattern of it, if it looks from near.

    Args:
        scene: of the module.
        action: to show.
        there: names of the parts that are there already.
        around: (n, 3) points that the picture fits, in m.
    """

    def sees(camera: OrthographicCamera, patterns: tuple[str, ...]) -> int:
        new = scene.matching(patterns)
        return scene.seen(camera, new, [*there, *(set(scene.matching(action.new)) - set(new))], around)

    if action.close:
        return max(BENCH, key=lambda c: math.prod(1 + sees(c, (p,)) for p in action.new))
    hidden = action.caps and sees(CAMERA, action.new) < HIDDEN * len(action.new)
    return BEHIND if hidden else CAMERA


def _both(nodes: tuple[int, ...]) -> str:
    return " and ".join(map(str, nodes))


def _picture(
    caption: str,
    action: Action,
    scene: ScenePictures,
    view: tuple[OrthographicCamera, np.ndarray],
    image: ImageReader,
    width: float,
) -> Flowable:
    height = width * SIZE[1] / SIZE[0]
    camera, around = view

    def draw(pen: Pen) -> None:
        pen.canvas.drawImage(image, 0, 26, width, height)
        for node in action.nodes:
            x, y = on_picture(camera, scene.middle(f"*_cap_{node}"), around, (width, height))
            away = np.array([x, y]) - (width / 2, height / 2)
            x, y = np.array([x, y]) + 11 * away / max(float(np.hypot(*away)), 1e-6)
            x, y = np.clip([x, y], 8, (width - 8, height - 8))
            pen.text(float(x), float(y) + 23, str(node), bold=True, size=9, align="centre", halo=True)
        for k, line in enumerate(_lines(caption)):
            pen.text(0, 16 - 10 * k, line, size=8, bold=True)

    return Picture(width, height + 26, draw, f"action {caption}")


def _lines(text: str, most: int = 50) -> list[str]:
    """Return a text in lines of so many letters at most."""
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) >= most and lines[-1]:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines
