"""Rows of a table of figures, each with a verdict."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table


@dataclasses.dataclass(frozen=True, slots=True)
class Row:
    """One figure.

    Attributes:
        what: what was measured.
        ours, wanted: the figure and what is asked of it, for people.
        passed: whether it is met; None for a figure of which nothing is asked.
    """

    what: str
    ours: str
    wanted: str
    passed: bool | None = None


def show(title: str, rows: Sequence[Row], console: Console) -> None:
    """Print rows as a table."""
    table = Table(title=title, title_justify="left")
    for heading in ("figure", "ours", "wanted", ""):
        table.add_column(heading)
    verdict = {True: "ok", False: "[bold red]short[/]", None: ""}
    for row in rows:
        table.add_row(row.what, row.ours, row.wanted, verdict[row.passed])
    console.print(table)
