"""``tensatlas recover`` and ``tensatlas migrate``: another file made of a run file, which stays as it is."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from engine.storage.migration import migrate
from engine.storage.recovery import recover
from engine.storage.schema import FORMAT_VERSION


def recover_run(path: Path, out: Path, like: Path | None, console: Console) -> None:
    """Save what is whole of a run and say what that is.

    Raises:
        RunFileError: nothing can be saved, or the new file cannot be written.
    """
    found = recover(path, out, like=like)
    after = f", {found.n_after} of them after the last whole generation" if found.n_after else ""
    console.print(
        f"Saved {found.n_generations} of {found.n_recorded} closed generations and"
        f" {found.n_evaluations} evaluations{after}, in {out}",
        markup=False,
    )
    for what, numbers in (("damaged", found.damaged), ("missing", found.missing)):
        if numbers:
            some = ", ".join(map(str, numbers[:10])) + (", ..." if len(numbers) > 10 else "")
            console.print(f"{len(numbers)} evaluations are {what}: {some}", markup=False)
    for note in found.notes:
        console.print(f"Note: {note}", markup=False)
    console.print(
        f"Go on with: tensatlas resume {out}"
        if found.resumable
        else f"It can be looked at, not gone on with: tensatlas explore {out}",
        markup=False,
    )


def migrate_run(path: Path, out: Path, console: Console) -> None:
    """Write a copy of a run in the present format.

    Raises:
        RunFileError: it cannot be read or has that format, or the copy cannot be written.
    """
    before = migrate(path, out)
    console.print(f"Wrote {out} in format {FORMAT_VERSION}; {path} is left in format {before}", markup=False)
