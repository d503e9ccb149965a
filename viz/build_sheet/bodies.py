"""A robot as tubes and balls that a scene can paint, in the colours of the sheet."""

from __future__ import annotations

from typing import Final

from reportlab.lib.colors import Color

from engine.body import module as t
from viz.build_sheet import style
from viz.build_sheet.facts import Facts, links
from viz.build_sheet.scene import Ball, Tube
from viz.robot.skeleton import Skeleton

CABLE_RADIUS: Final = 0.0005
"""Cables have no thickness in the model; they are drawn this thick, in m."""
NODE_RADIUS: Final = 0.0022
ARM_RADIUS: Final = t.ACTUATOR_RADIUS


def robot(facts: Facts) -> list[Tube | Ball]:
    """Return the whole robot, levelled; the rods of its head module have a colour of their own."""
    body = facts.levelled
    things: list[Tube | Ball] = []
    for i in range(body.n_modules):
        plain = style.HEAD if i == facts.head.module else style.ROD
        things += [rod(body, i, r, style.SERVO if r == t.SERVO_ROD else plain) for r in range(len(t.RODS))]
        things += [Ball(p, NODE_RADIUS, style.NODE) for p in body.nodes[i]]
        things += servo(body, i)
        things += [Tube(a, b, CABLE_RADIUS, style.CABLE) for a, b in body.cables[i]]
    things += [Tube(a, b, 2 * CABLE_RADIUS, style.LINK) for a, b in links(body, facts.joints)]
    return things


def rod(body: Skeleton, i: int, r: int, color: Color) -> Tube:
    """Return rod ``r`` of module ``i``."""
    start, end = body.rods[i, r]
    return Tube(start, end, t.ROD_RADIUS, color)


def servo(body: Skeleton, i: int) -> list[Tube | Ball]:
    """Return the servo's arm of a module, its guide and its five internal cables, in that order."""
    middle = body.rods[i, t.SERVO_ROD].mean(axis=0)
    return [
        Tube(middle, body.arms[i], t.ROD_RADIUS, style.SERVO),
        Ball(body.arms[i], ARM_RADIUS, style.SERVO),
        *(Tube(p, q, CABLE_RADIUS, style.SERVO_CABLE) for p, q in body.servo_cables[i]),
    ]
