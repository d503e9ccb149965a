"""One difference between a built robot and the simulated one, and how it is known."""

from __future__ import annotations

import dataclasses
import enum
from typing import Any, Final

TOLERANCE: Final = 2.0
"""A tolerance of the sheet is this many standard deviations."""


class Origin(enum.StrEnum):
    """How a difference is known."""

    COMPUTED = "computed"
    """From the design and the materials."""
    MEASURED = "measured"
    """Somebody measured it and entered it in the materials file."""
    ASSUMED = "assumed"
    """From a data sheet, or by us."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """One difference between a built robot and the simulated one.

    Attributes:
        key: its short name, for tables and files.
        name: what it is, for people.
        simulated, built: the value there and here, for people, with units.
        spread: how robots differ from each other, for people; empty if they do not.
        origin: how the value is known.
        source: where from.
        remedy: what would make it smaller.
        figures: fields of ``simulation.built.Built`` and their values.
        scatter: fields of ``simulation.built.Spread`` and their values.
    """

    key: str
    name: str
    simulated: str
    built: str
    spread: str
    origin: Origin
    source: str
    remedy: str
    figures: dict[str, Any] = dataclasses.field(default_factory=dict)
    scatter: dict[str, float] = dataclasses.field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return JSON-ready values."""
        return dataclasses.asdict(self) | {"origin": str(self.origin)}


def grams(kilograms: float) -> str:
    """Return a mass for people."""
    return f"{1e3 * kilograms:.2f} g"
