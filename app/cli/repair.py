"""The commands ``recover``, ``migrate`` and ``slim``: another file from a run file, which stays as it is."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import tyro
from rich.console import Console

from engine.errors import as_typed
from engine.storage.migration import migrate, slim
from engine.storage.recovery import recover
from engine.storage.schema import FORMAT_VERSION


@dataclasses.dataclass(frozen=True, kw_only=True)
class Recover:
    """Save every whole generation of a damaged run, and the evaluations after them, into a new file."""

    path: tyro.conf.Positional[Path]
    """Run file; it is only read."""
    out: Path
    """Run file to create, *.tsmr."""
    like: Path | None = None
    """A run of the same configuration, for a file that has lost its own."""

    def run(self, console: Console) -> None:
        """Save what is whole, and report it.

        Raises:
            RunFileError: nothing can be saved, or the new file cannot be written.
        """
        found = recover(self.path, self.out, like=self.like)
        after = f", {found.n_after} of them after the last whole generation" if found.n_after else ""
        console.print(
            f"Saved {found.n_generations} of {found.n_recorded} closed generations and"
            f" {found.n_evaluations} evaluations{after}, in {as_typed(self.out)}",
            markup=False,
        )
        for what, numbers in (("damaged", found.damaged), ("missing", found.missing)):
            if numbers:
                some = ", ".join(map(str, numbers[:10])) + (", ..." if len(numbers) > 10 else "")
                console.print(f"{len(numbers)} evaluations are {what}: {some}", markup=False)
        for note in found.notes:
            console.print(f"Note: {note}", markup=False)
        console.print(
            f"Continue with: tensatlas resume {as_typed(self.out)}"
            if found.resumable
            else f"It can be viewed, not resumed: tensatlas explore {as_typed(self.out)}",
            markup=False,
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Migrate:
    """Write a copy of a run in the present format; the file of the older format stays as it is."""

    path: tyro.conf.Positional[Path]
    """Run file; it is only read."""
    out: Path
    """Run file to create, *.tsmr."""

    def run(self, console: Console) -> None:
        """Write the copy.

        Raises:
            RunFileError: the run cannot be read or has that format, or the copy cannot be written.
        """
        before = migrate(self.path, self.out)
        console.print(
            f"Wrote {as_typed(self.out)} in format {FORMAT_VERSION};"
            f" {as_typed(self.path)} is left in format {before}",
            markup=False,
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Slim:
    """Write a small copy of a run for showing: with all that the explorer shows, but not to be resumed."""

    path: tyro.conf.Positional[Path]
    """Run file; it is only read."""
    out: Path
    """Run file to create, *.tsmr."""

    def run(self, console: Console) -> None:
        """Write the copy.

        Raises:
            RunFileError: the run cannot be read, is slimmed already or being written, or the copy cannot be
                written.
        """
        slimmed = slim(self.path, self.out)
        before, now = (path.stat().st_size / 1e6 for path in (self.path, self.out))
        console.print(
            f"Wrote {self.out} with {slimmed.n_kept} robots: {now:.1f} MB instead of {before:.1f}; look at it"
            f" with: tensatlas explore {as_typed(self.out)}",
            markup=False,
        )
