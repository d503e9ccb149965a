"""A small drawing of a body, made in the browser from its faces alone: at once, for any robot pointed at.

As built, the modules of a chain stand in a row and differ only in how each is turned, which its face and its
place in the row decide. So sixteen drawings of a module serve for all bodies.
"""

from __future__ import annotations

import functools
import importlib.resources
import json
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.morphology import MIN_MODULES, N_FACES, Morphology
from engine.simulation.model import DROP_HEIGHT, module_placements
from viz import theme
from viz.robot.skeleton import Skeleton

RIGHT: Final = np.array([0.906, -0.423, 0.0])
UP: Final = np.array([0.145, 0.31, 0.94])
"""Where a point's x and y of the drawing come from, seen from before the row and a little above."""
MARGIN: Final = 60
"""Units around the middles of the first and the last module, as in the script."""
UNIT: Final = 0.001
"""Metres of a unit of the drawing."""


def code(morphology: Morphology) -> str:
    """Return the faces of a body as the browser takes them, one figure each."""
    return "".join(map(str, morphology.faces))


@functools.cache
def script() -> str:
    """Return the JavaScript of ``taBody(faces, head)``, which returns SVG; ``head`` is a module's index."""
    first, second = (_flat(np.array([[k * t.MODULE_SPACING, 0.0, DROP_HEIGHT]]))[0] for k in (0, 1))
    data = {
        "modules": [[_module(face, odd) for face in range(1, N_FACES + 1)] for odd in (0, 1)],
        "step": [round(float(v), 2) for v in second - first],
        "colors": {
            "rod": theme.css(theme.ROD),
            "head": theme.css(theme.HEAD_ROD),
            "servo": theme.css(theme.SERVO_ROD),
            "cable": theme.css(theme.CABLE_TAUT),
        },
    }
    source = (importlib.resources.files(__package__) / "body_drawing.js").read_text(encoding="utf-8")
    return source.replace("@data@", json.dumps(data, separators=(",", ":")))


@functools.cache
def symbols() -> str:
    """Return hidden SVG with a symbol of every drawing of a module; what ``svg`` returns refers to them."""
    colors = {
        "rods": "var(--ta-rod)",
        "servo": theme.css(theme.SERVO_ROD),
        "cables": theme.css(theme.CABLE_TAUT),
    }
    found = []
    for odd in (0, 1):
        for face in range(1, N_FACES + 1):
            paths = _module(face, odd)
            lines = "".join(
                f'<path d="{paths[what]}" style="stroke:{colors[what]};'
                f'stroke-width:calc({width}px*var(--ta-thick))"/>'
                for what, width in (("cables", 0.9), ("rods", 3.6), ("servo", 3.6))
            )
            found.append(f'<symbol id="ta-module-{odd}-{face}" overflow="visible">{lines}</symbol>')
    return f'<svg aria-hidden="true" width="0" height="0" style="position:absolute">{"".join(found)}</svg>'


def svg(morphology: Morphology, head: int) -> str:
    """Return a drawing as ``taBody`` makes it, of few bytes, for a page that has ``symbols``.

    Args:
        morphology: the body.
        head: index of the head module.
    """
    first, second = (_flat(np.array([[k * t.MODULE_SPACING, 0.0, DROP_HEIGHT]]))[0] for k in (0, 1))
    dx, dy = second - first
    n = morphology.n_modules
    width, height = (n - 1) * dx + 2 * MARGIN, (n - 1) * abs(dy) + 2 * MARGIN
    top = min((n - 1) * dy, 0.0) - MARGIN
    thick = max(1.0, n / 5)  # long robots are drawn smaller
    colors = [theme.css(theme.HEAD_ROD if i == head else theme.ROD) for i in range(n)]
    modules = "".join(
        f'<use href="#ta-module-{i % 2}-{face}" x="{i * dx:.1f}" y="{i * dy:.1f}"'
        f' style="--ta-thick:{thick:g};--ta-rod:{colors[i]}"/>'
        for i, face in enumerate(morphology.faces)
    )
    return (
        f'<svg class="ta-body" viewBox="{-MARGIN:g} {top:.1f} {width:.1f} {height:.1f}" fill="none"'
        f' stroke-linecap="round" aria-hidden="true">{modules}</svg>'
    )


def _module(face: int, odd: int) -> dict[str, str]:
    """Return a module's rods, servo rod and cables as SVG paths, its centre at the origin."""
    faces = tuple(face for _ in range(MIN_MODULES))
    turn, _ = module_placements(Morphology(stiffness_level=10, faces=faces))[odd]
    body = Skeleton.placed([(Rotation.from_quat(turn.as_quat()), np.zeros(3))])
    rods = body.rods[0]
    plain = np.delete(rods, t.SERVO_ROD, axis=0)
    return {"rods": _path(plain), "servo": _path(rods[[t.SERVO_ROD]]), "cables": _path(body.cables[0])}


def _path(segments: np.ndarray) -> str:
    """Return (n, 2, 3) segments as the ``d`` of an SVG path."""
    flat = np.round(_flat(segments), 1)
    return "".join(f"M{a[0]:g} {a[1]:g}L{b[0]:g} {b[1]:g}" for a, b in flat)


def _flat(points: np.ndarray) -> np.ndarray:
    """Return where (..., 3) points, in m, lie in a drawing whose y points down, (..., 2)."""
    return np.stack([points @ RIGHT, -(points @ UP)], axis=-1) / UNIT
