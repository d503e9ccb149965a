"""A controller's network as a small SVG, and a style that shows in it what the neurons do.

The picture is drawn once per robot. What changes while the robot moves is a style of one short rule per
neuron: a twentieth of the picture, and the browser draws nothing anew but colours and lengths.
"""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence

import numpy as np

from engine.body import module as t
from engine.body import servo
from engine.control.genome import N_OUTPUTS, ConnectionGene, Controller
from engine.control.network import Network
from engine.tasks import Task

WIDTH = 300
POSITIVE, NEGATIVE = "#5aa9e6", "#e6786e"
REST, ACTIVE = (58, 66, 80), (255, 214, 92)
"""Colours of a neuron at 0 and at 1."""
MOST_NEURONS, MOST_LINKS = 300, 1500
"""A larger network's hidden part is not drawn: nobody could read it, and it costs every browser time."""
ROW = 13.0
_INPUTS, _HIDDEN, _OUTPUTS = 76.0, (104.0, 158.0), 186.0
_BAR = (194.0, 40.0)
"""Where an output's bar begins and how long it is at 1."""
_VALUE = 240.0
_FREQUENCIES = [f"{f:g} Hz" for f in servo.FREQUENCIES]
_PHASES = [f"{round(np.degrees(p) / 90) * 90}°" for p in servo.PHASES]


class NetworkDiagram:
    """Draws the network of one robot.

    Args:
        controller: the network.
        n_modules: how many modules it drives; the other outputs are not drawn.
        input_names: what its inputs are called.
        head_is_end: whether the last module is the head, which the first pair of outputs drives.
    """

    def __init__(
        self, controller: Controller, n_modules: int, input_names: Sequence[str], *, head_is_end: bool
    ) -> None:
        self.network = Network(controller, n_modules)
        self._controller = controller
        drawn = {*self.network.levels, *self.network.outputs}
        self._links = [c for c in controller.connections if c.enabled and c.target in drawn]
        self._levels = self.network.levels
        self._remark = ""
        if len(drawn) > MOST_NEURONS or len(self._links) > MOST_LINKS:
            self._remark = (
                f'<div class="ta-network-large" style="font-size:11.5px;opacity:.8;padding:3px 10px">'
                f"{len(self._levels)} hidden neurons and {len(self._links)} connections are too many to be"
                " drawn.</div>"
            )
            self._links, self._levels = [], {}
        self._names = input_names
        order = range(n_modules - 1, -1, -1) if head_is_end else range(n_modules)
        self.modules = tuple(order)
        """Per pair of outputs the index of the module that it drives."""

    def render(self) -> str:
        """Return the picture: inputs left, hidden nodes, frequency and phase of each module right."""
        place = self._places()
        height = max(place[k][1] for k in place) + ROW
        bias = {n.key: n.bias for n in self._controller.nodes}
        names = {-1 - k: name for k, name in enumerate(self._names)}
        parts = [
            f'<svg class="ta-network" viewBox="0 0 {WIDTH} {height:.0f}" width="100%"'
            ' style="display:block;font:9px system-ui,sans-serif;font-variant-numeric:tabular-nums">'
            "<style>.ta-network circle{transition:fill .1s linear}"
            ".ta-network .bar{transition:transform .1s linear;transform:scaleX(0)}"
            ".ta-network .opt{opacity:0}</style>"
        ]
        parts += [_link(c, place, names) for c in sorted(self._links, key=lambda c: abs(c.weight))]
        for key, (x, y) in place.items():
            hint = f"{names[key]}" if key < 0 else f"node {key}, bias {bias[key]:.3f}"
            parts.append(
                f'<circle class="n{key}" cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{_hex(REST)}"'
                f' stroke="currentColor" stroke-opacity="0.45"><title>{html.escape(hint)}</title></circle>'
            )
            if key < 0:
                parts.append(
                    f'<text x="{x - 8}" y="{y + 3:.1f}" text-anchor="end" fill="currentColor">'
                    f"{html.escape(names[key])}</text>"
                )
        parts += [self._module(k, place) for k in range(len(self.modules))]
        parts.append(f"</svg>{self._remark}")
        return "".join(parts)

    def style(self, neurons: Mapping[int, float]) -> str:
        """Return the rules that colour the neurons, stretch the outputs' bars and show what they choose.

        Args:
            neurons: activation by key, in [0, 1]; empty while the network has no say.
        """
        rules = [
            f".n{key}{{fill:{_SHADES[_percent(value)]}}}"
            for key, value in neurons.items()
            if key < N_OUTPUTS or key in self._levels
        ]
        for first, options in ((0, servo.FREQUENCIES), (1, servo.PHASES)):
            keys = [key for key in self.network.outputs[first::2] if key in neurons]
            values = np.array([neurons[key] for key in keys])
            chosen = np.argmax(servo.pick(options, values)[:, None] == options, axis=1)
            for key, value, option in zip(keys, values.tolist(), chosen.tolist(), strict=True):
                rules.append(f".b{key}{{transform:scaleX({value:.2f})}}")
                rules.append(f".o{key}-{option}{{opacity:1}}")
        return "".join(f".ta-network {rule}" for rule in rules)

    def _places(self) -> dict[int, tuple[float, float]]:
        """Return where each node is: hidden ones from left to right by how far they are from the inputs."""
        levels, outputs = self._levels, self.network.outputs
        deepest = max(levels.values(), default=1)
        height = max(ROW * len(outputs), 18.0 * len(self._names), 70.0)
        place = {-1 - k: (_INPUTS, height * (k + 0.5) / len(self._names)) for k in range(len(self._names))}
        left, right = _HIDDEN
        for k, (key, level) in enumerate(levels.items()):
            x = (left + right) / 2 if deepest == 1 else left + (right - left) * (level - 1) / (deepest - 1)
            # nodes of one level stand a little apart, so that their links can be told apart
            x += (k % 3 - 1) * 7 if deepest == 1 else (k % 2 - 0.5) * 6
            place[key] = (x, height * (k + 0.5) / len(levels))
        return place | {key: (_OUTPUTS, height * (key + 0.5) / len(outputs)) for key in outputs}

    def _module(self, k: int, place: Mapping[int, tuple[float, float]]) -> str:
        """Return what stands right of a pair of outputs: bars with the choices' limits, choices, number."""
        start, full = _BAR
        top, bottom = place[2 * k][1], place[2 * k + 1][1]
        parts = [
            f'<g data-m="{self.modules[k]}"><rect class="ta-back" x="{_OUTPUTS - 6:g}" y="{top - 6:.1f}"'
            f' width="{WIDTH - _OUTPUTS + 6:g}" height="{bottom - top + 12:.1f}" rx="3" fill-opacity="0"/>'
        ]
        for key, options in ((2 * k, _FREQUENCIES), (2 * k + 1, _PHASES)):
            y = place[key][1]
            parts.append(
                f'<rect x="{start}" y="{y - 3:.1f}" width="{full}" height="6" rx="1" fill="currentColor"'
                f' fill-opacity="0.13"/><rect class="bar b{key}" x="{start}" y="{y - 3:.1f}" width="{full}"'
                f' height="6" rx="1" fill="{_hex(ACTIVE)}" style="transform-origin:{start}px 0"/>'
            )
            for i in range(1, len(options)):
                x = start + full * i / len(options)
                parts.append(
                    f'<path d="M{x:.1f} {y - 3:.1f}v6" stroke="currentColor" stroke-opacity="0.55"'
                    ' stroke-width="0.8"/>'
                )
            parts += [
                f'<text class="opt o{key}-{i}" x="{_VALUE}" y="{y + 3:.1f}" fill="currentColor">'
                f"{option}</text>"
                for i, option in enumerate(options)
            ]
        y = (top + bottom) / 2
        head = ' style="font-weight:700"' if k == 0 else ""
        number = t.module_number(self.modules[k])
        what = f"module {number}" + (", the head" if k == 0 else "")
        parts.append(
            f'<path d="M275 {top - 4:.1f}h3v{bottom - top + 8:.1f}h-3"'
            ' fill="none" stroke="currentColor" stroke-opacity="0.4"/>'
            f'<text x="282" y="{y + 3:.1f}" fill="currentColor"{head}>{number}<title>{what}</title>'
            "</text></g>"
        )
        return "".join(parts)


def legend() -> str:
    """Return what the lines, circles and bars mean."""

    def line(color: str, width: float) -> str:
        return (
            f'<svg width="20" height="8" style="vertical-align:middle"><path d="M1 4h18" stroke="{color}"'
            f' stroke-width="{width:.1f}"/></svg>'
        )

    def dot(color: Sequence[int]) -> str:
        return (
            '<span style="display:inline-block;width:7px;height:7px;border-radius:50%;'
            f'border:1px solid currentColor;background:{_hex(color)}"></span>'
        )

    return (
        '<div class="ta-network-legend"'
        ' style="font-size:11px;line-height:1.7;opacity:.75;padding:2px 10px 4px">'
        f"{line(POSITIVE, 1.8)} excites {line(NEGATIVE, 1.8)} inhibits · weight"
        f" {line('currentColor', _width(0.5))} 0.5 {line('currentColor', _width(2.0))} 2"
        f" {line('currentColor', _width(5.0))} 5<br>"
        f"{dot(ACTIVE)} active {dot(REST)} at rest"
        " · bars: frequency and phase of each module, in the numbers of the picture, the head first</div>"
    )


def sensed_line(task: Task, sensed: Sequence[float] | np.ndarray | None) -> str:
    """Return what the inputs are at the moment, as HTML.

    Args:
        task: of the robot, as it is sensed in its run.
        sensed: (inputs,) what the network gets, None while it has no say.
    """
    if sensed is None:
        what = "the robot settles: the network has no say yet"
    else:
        what = " · ".join(
            f"{html.escape(name)} <b>{_in_words(float(value), factor, unit)}</b>"
            for name, value, factor, unit in zip(task.inputs, sensed, task.units, task.sensed_in, strict=True)
        )
    return (
        '<div class="ta-sensed"'
        ' style="font-size:11.5px;padding:3px 10px 0;font-variant-numeric:tabular-nums">'
        f'<span style="opacity:.65">senses</span> {what}</div>'
    )


def _in_words(value: float, factor: float, unit: str) -> str:
    """Return an input as people say it; the network gets it times the factor of its task."""
    if unit == "m" and factor:
        return f"{100 * value / factor:.1f} cm"
    if unit == "rad" and factor:
        return f"{round(math.degrees(value / factor)) + 0}°"
    return f"{value:.2f}"


def _link(c: ConnectionGene, place: Mapping[int, tuple[float, float]], names: Mapping[int, str]) -> str:
    (x1, y1), (x2, y2) = place[c.source], place[c.target]
    source = html.escape(names.get(c.source, str(c.source)))
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"'
        f' stroke="{POSITIVE if c.weight > 0 else NEGATIVE}" stroke-opacity="0.75"'
        f' stroke-width="{_width(c.weight):.2f}">'
        f"<title>{source} to {c.target}: {c.weight:.3f}</title></line>"
    )


def _width(weight: float) -> float:
    return min(0.4 + 0.5 * abs(weight), 3.0)


def _percent(part: float) -> int:
    return round(100 * min(max(part, 0.0), 1.0))


def _hex(color: Sequence[int]) -> str:
    return "#" + "".join(f"{c:02x}" for c in color)


_SHADES = [
    _hex([round(a + (b - a) * k / 100) for a, b in zip(REST, ACTIVE, strict=True)]) for k in range(101)
]
"""Fills of a neuron whose activation is so many percent."""
