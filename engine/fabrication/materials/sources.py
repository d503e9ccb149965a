"""Where a number on a build sheet comes from."""

from __future__ import annotations

import enum


class Source(enum.StrEnum):
    """Where a number comes from; a number computed from several has the least certain of their sources."""

    SIMULATED = "simulated"
    """The simulation uses it, or computed it."""
    MEASURED = "measured"
    """It was measured on a real specimen and entered in the materials file."""
    ASSUMED = "assumed"
    """A data sheet's or the designer's value, which the simulation does not know."""


_ORDER = (Source.SIMULATED, Source.MEASURED, Source.ASSUMED)


def least_certain(*sources: Source) -> Source:
    """Return the source of a number that is computed from numbers of these sources."""
    return max(sources, key=_ORDER.index)
