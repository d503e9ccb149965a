"""Feet that grip one way: bristles or scales at the nodes, which slide forward and hold backward."""

from __future__ import annotations

import dataclasses
from typing import Final, Literal

from engine.errors import InvalidData

Feet = Literal["none", "start", "end"]
"""A robot's feet: none, or ones that slide towards the start or the end of its chain."""
FEET: Final[tuple[Feet, ...]] = ("none", "start", "end")

FeetMode = Literal["none", "directional", "evolved"]
"""Whether a run's robots have no such feet, all have them, or each by a gene of its own."""

FEET_TEXT: Final[dict[Feet, str]] = {"none": "none", "start": "toward the start", "end": "toward the end"}
"""What a person reads of a robot's feet."""


def feet_note(feet: Feet) -> str:
    """Return what to add to a few words about a body: ``, feet toward the end``, or nothing without feet."""
    return "" if feet == "none" else f", feet {FEET_TEXT[feet]}"


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class BodyConfig:
    """What the bodies of a run have beyond modules; part of a run's configuration."""

    feet: FeetMode = "none"
    """Feet that grip one way: on no robot (none), on all (directional), or by a gene of each (evolved)."""
    feet_toward: Literal["end", "start"] = "end"
    """Towards which end of the chain the feet of --body.feet directional slide."""
    feet_axis: bool = False
    """Make evolved feet one more axis of the maps of the body: none, toward the start, toward the end."""

    def __post_init__(self) -> None:
        if self.feet_axis and self.feet != "evolved":
            raise InvalidData(
                f"feet_axis is for feet that evolve; feet is {self.feet}: use --body.feet evolved"
            )

    @property
    def feet_genes(self) -> tuple[Feet, ...]:
        """The feet that a robot may have."""
        match self.feet:
            case "none":
                return ("none",)
            case "directional":
                return (self.feet_toward,)
            case "evolved":
                return FEET
