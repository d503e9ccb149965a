"""What the colours of the cables and the arrows of friction mean, as a small HTML legend."""

from __future__ import annotations

from engine.body import module as t
from viz import theme
from viz.robot.geometry import ARROW_PER_NEWTON


def render(full_tension: float) -> str:
    """Return the legend.

    Args:
        full_tension: in N, at which a passive cable has its full colour.
    """
    return (
        '<span class="ta-tension" title="Elastic tension, without the damping of the cables"'
        ' style="white-space:nowrap;font-size:11.5px">'
        + _bar("cables", theme.CABLE_SLACK, theme.CABLE_TAUT, full_tension)
        + _bar("servo", theme.SERVO_SLACK, theme.SERVO_TAUT, t.SERVO_MAX_TENSION)
        + "</span>"
    )


def friction() -> str:
    """Return the legend of the arrows on the ground."""
    return (
        '<span class="ta-friction" title="How hard the ground pushes a rod end along the floor"'
        ' style="white-space:nowrap;font-size:11.5px;margin-left:10px">friction'
        f' <span style="color:{theme.css(theme.CONTACT)}">⟶</span>'
        f' <span style="opacity:.7">1 cm: {0.01 / ARROW_PER_NEWTON:.2g} N</span></span>'
    )


def _bar(name: str, low: tuple[int, ...], high: tuple[int, ...], most: float) -> str:
    return (
        f'<span style="margin-left:10px">{name} <span style="opacity:.7">0</span>'
        '<span style="display:inline-block;width:46px;height:7px;border-radius:3px;margin:0 4px;'
        f'background:linear-gradient(90deg,rgb{low},rgb{high})"></span>'
        f'<span style="opacity:.7">{most:.2g} N</span></span>'
    )
