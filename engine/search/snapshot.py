"""What whoever stores a run needs of an algorithm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from engine.search.algorithm import Axis
from engine.search.archive import GridArchive


class Snapshot(Protocol):
    """What a generation leaves behind; every algorithm is one after its ``tell``."""

    @property
    def generation(self) -> int:
        """Number of completed generations."""
        ...

    @property
    def archives(self) -> Mapping[str, GridArchive]:
        """The archives by name."""
        ...

    def axes(self, archive: str) -> tuple[Axis, ...]:
        """Describe the axes of an archive as they are now."""
        ...

    def state(self) -> dict[str, Any]:
        """Return the JSON-ready state at the end of a generation, archives excluded."""
        ...
