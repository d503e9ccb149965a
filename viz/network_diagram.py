"""A controller's network as a small SVG."""

from __future__ import annotations

import html
from collections.abc import Sequence

from engine.controller import N_OUTPUTS, Controller

WIDTH = 300
POSITIVE, NEGATIVE = "#5aa9e6", "#e6786e"


def render(controller: Controller, n_modules: int, input_names: Sequence[str]) -> str:
    """Return the expressed network: inputs left, hidden nodes, frequency and phase of each module.

    Args:
        controller: the network.
        n_modules: how many modules it drives; the other outputs are not drawn.
        input_names: what its inputs are called.
    """
    outputs = list(range(2 * n_modules))
    links = [c for c in controller.connections if c.enabled]
    hidden = _needed(links, outputs)
    links = [c for c in links if c.target in {*hidden, *outputs}]
    inputs = [-1 - i for i in range(controller.n_inputs)]
    height = max(90, 13 * len(outputs) + 8)
    place: dict[int, tuple[float, float]] = {}
    for x, column in ((62.0, inputs), (150.0, hidden), (242.0, outputs)):
        for k, node in enumerate(column):
            # hidden nodes that feed hidden nodes sit a little apart
            shift = (k % 3 - 1) * 16 if column is hidden else 0
            place[node] = (x + shift, height * (k + 0.5) / len(column))
    parts = [
        f'<svg class="ta-network" viewBox="0 0 {WIDTH} {height}" width="100%"'
        ' style="display:block;font:9px system-ui,sans-serif">'
    ]
    for c in links:
        (x1, y1), (x2, y2) = place[c.source], place[c.target]
        parts.append(
            f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"'
            f' stroke="{POSITIVE if c.weight > 0 else NEGATIVE}" stroke-opacity="0.75"'
            f' stroke-width="{min(0.4 + 0.5 * abs(c.weight), 3):.2f}">'
            f"<title>{c.source} to {c.target}: {c.weight:.3f}</title></line>"
        )
    bias = {n.key: n.bias for n in controller.nodes}
    for node, (x, y) in place.items():
        hint = f"node {node}, bias {bias[node]:.3f}" if node in bias else f"input {node}"
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#8b93a1" stroke="currentColor"'
            f' stroke-opacity="0.4"><title>{hint}</title></circle>'
        )
    for k, node in enumerate(inputs):
        x, y = place[node]
        name = html.escape(input_names[k])
        parts.append(f'<text x="{x - 8}" y="{y + 3}" text-anchor="end" fill="currentColor">{name}</text>')
    for node in outputs:
        x, y = place[node]
        kind = "phase" if node % 2 else "freq."
        parts.append(f'<text x="{x + 8}" y="{y + 3}" fill="currentColor">{node // 2 + 1} {kind}</text>')
    parts.append("</svg>")
    return "".join(parts)


def _needed(links: list, outputs: list[int]) -> list[int]:
    """Return the hidden nodes that some drawn output depends on, those nearest the inputs first."""
    found: dict[int, None] = {}
    frontier = outputs
    while frontier:
        sources = [c.source for c in links if c.target in frontier and c.source >= N_OUTPUTS]
        frontier = [s for s in dict.fromkeys(sources) if s not in found]
        found |= dict.fromkeys(frontier)
    return list(reversed(found))
