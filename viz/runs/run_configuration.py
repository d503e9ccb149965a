"""All that decides a run's outcome, to be read: the configuration as a TOML file has it."""

from __future__ import annotations

import html

from engine.config import RunConfig
from engine.runs.described import describe


def render(config: RunConfig) -> str:
    """Return the configuration, folded."""
    return (
        '<details class="ta-configuration" style="font-size:12.5px;padding:2px 10px 6px"><summary'
        ' style="cursor:pointer">Configuration</summary><pre style="font-size:11.5px;line-height:1.45;'
        'margin:4px 0 0;max-height:min(300px,40vh);overflow:auto;user-select:text">'
        f"{html.escape(describe(config))}</pre></details>"
    )
