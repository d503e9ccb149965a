"""The command ``doctor``: checks this installation and run files."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import tyro
from packaging.requirements import Requirement
from rich.console import Console

from engine.config import preset
from engine.errors import TensAtlasError, as_typed, printable
from engine.simulation.compile_kernel import NOTICE, compile_kernel, is_compiled, kept_in
from engine.simulation.provenance import instruction_sets, processor_facts, versions
from engine.simulation.self_check import compare
from engine.storage.check import Finding, check_run
from engine.storage.reader import RunReader
from engine.storage.writer import RunWriter, is_being_written

PROBLEMS: Final = 1
"""Exit status if a problem was found."""
_CONSTRAINTS: Final = Path(__file__).resolve().parents[1] / "constraints.txt"
_FEATURES: Final = ("avx2", "fma", "avx512f")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Doctor:
    """Check this installation and run files: one line for each check, with what to do about a problem.

    Ends with 1 if there is a problem.
    """

    paths: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Run files; they are only read."""
    port: int = 8080
    """Port that the app would listen on."""

    def run(self, _: Console) -> int:
        """Print a line for each check to standard output; return the exit status."""
        out = Console(highlight=False, soft_wrap=True)
        n_problems = 0
        for finding in _findings(self.paths, self.port):
            n_problems += finding.verdict == "problem"
            remedy = f"; {finding.remedy}" if finding.remedy else ""
            out.print(printable(f"{finding.verdict:<8} {finding.text}{remedy}"), markup=False)
        if n_problems:
            out.print(f"{n_problems} problem{'s' if n_problems > 1 else ''} found", markup=False)
            return PROBLEMS
        out.print("No problem found", markup=False)
        return 0


def _findings(runs: Sequence[Path], port: int) -> Iterator[Finding]:
    yield from _python()
    yield from _packages()
    yield _processor()
    yield _kernel()
    yield from _simulation()
    yield from _folder(runs[0].absolute().parent if runs else _new_runs(), holds_runs=bool(runs))
    yield _port(port)
    yield _chromium()
    for run in runs:
        yield from check_run(run)


def _python() -> Iterator[Finding]:
    version = platform.python_version()
    yield Finding("ok", f"Python {version}, {sys.executable}")


def _packages() -> Iterator[Finding]:
    try:
        requirements = [Requirement(r) for r in importlib.metadata.requires("tensatlas") or []]
    except importlib.metadata.PackageNotFoundError:
        yield Finding("problem", "TensAtlas is not installed here", "make explore sets everything up")
        return
    wanted = [r for r in requirements if r.marker is None or r.marker.evaluate({"extra": ""})]
    wrong = {}
    for r in wanted:
        version = _version(r.name)
        if version is None:
            wrong[r.name] = f"{r.name} is missing"
        elif not r.specifier.contains(version, prereleases=True):
            wrong[r.name] = f"{r.name} {version} is not {r.specifier}"
    install = f"pip install -c {as_typed(_CONSTRAINTS)}"
    if wrong:
        yield Finding("problem", ", ".join(wrong.values()), f"{install} {' '.join(wrong)} mends that")
    else:
        yield Finding("ok", f"all {len(wanted)} packages that it needs are installed")
    lines = _CONSTRAINTS.read_text(encoding="utf-8").splitlines()
    pins = dict(line.split("==") for line in lines if "==" in line and not line.startswith("#"))
    found = {n: v for n, pin in pins.items() if (v := _version(n)) not in (None, pin)}
    if found:
        others = ", ".join(f"{n} {v} instead of {pins[n]}" for n, v in found.items())
        remedy = f"{install} {' '.join(found)} gives the versions that the tests pass with"
        yield Finding("note", f"other versions than tested: {others}", remedy)
    else:
        yield Finding("ok", "all of the versions that the tests pass with")


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _processor() -> Finding:
    facts, flags = processor_facts(), instruction_sets()
    name = facts.get("model name", platform.processor() or platform.machine())
    features = ""
    if facts:  # only Linux says so
        features = ": " + (", ".join(f for f in _FEATURES if f in flags) or "none of " + ", ".join(_FEATURES))
    n = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return Finding("ok", f"{n} core{'s' if n > 1 else ''}, {name}{features}")


def _kernel() -> Finding:
    if not is_compiled():
        print(NOTICE, flush=True)
    compile_kernel()
    if (folder := kept_in()) is not None:
        return Finding("ok", f"the simulation is compiled for this processor, kept in {folder}")
    return Finding(
        "note",
        "what is compiled for this processor cannot be kept: the cache folder cannot be written",
        "TENSATLAS_CACHE names another one; without it every start takes half a minute longer",
    )


def _simulation() -> Iterator[Finding]:
    found = compare()
    if not found.same_body:
        yield Finding(
            "problem",
            f"MuJoCo {_version('mujoco')} builds other bodies than the known simulation has",
            "install TensAtlas and the versions of constraints.txt anew",
        )
    elif found.identical:
        yield Finding("ok", f"the known simulation comes out to the last bit ({found.digest})")
    else:
        yield Finding(
            "problem",
            f"the known simulation is {found.deviation:.1e} m off, and has to come out to the last bit on any"
            f" computer (Numba {_version('numba')}, LLVM by llvmlite {_version('llvmlite')})",
            "do not compare results with those of other computers; install the versions of constraints.txt",
        )


def _new_runs() -> Path:
    """Return the folder that the app starts runs in."""
    from app.runs.library import NEW_RUNS

    return NEW_RUNS.absolute()


def _folder(folder: Path, *, holds_runs: bool) -> Iterator[Finding]:
    """Check the folder of the first run named, or where new ones would be."""
    there = folder
    while not there.is_dir() and there != there.parent:
        there = there.parent
    free = shutil.disk_usage(there).free
    text = f"{free / 1e9:.1f} GB free in {there}"
    if free < 200e6:
        yield Finding("problem", text, "make room: a run of the paper's size has 0.3 GB")
    elif free < 2e9:
        yield Finding("note", text, "a run of the paper's size has 0.3 GB")
    else:
        yield Finding("ok", text)
    try:
        with tempfile.TemporaryDirectory(prefix=".doctor-", dir=there) as name:
            path = Path(name) / "doctor.tsmr"
            with RunWriter.create(path, preset("smoke"), versions()), RunReader(path) as reader:
                live = is_being_written(path)
                reader.n_evaluations()
        if live:
            yield Finding("ok", f"a run can be written, read meanwhile and locked in {there}")
        else:
            yield Finding("problem", f"{there} does not lock files", "keep runs on another file system")
    except (OSError, TensAtlasError) as e:
        reason = e.strerror if isinstance(e, OSError) else str(e)
        if holds_runs and not os.access(there, os.W_OK):
            remedy = "runs there can be looked at; to resume one, copy it to another folder"
            yield Finding("note", f"nothing can be written in {there}: {reason}", remedy)
            return
        yield Finding("problem", f"no run can be written in {there}: {reason}", "choose another folder")


def _port(port: int) -> Finding:
    # the app's libraries take a second to import
    from app.server.server import check_address

    try:
        check_address("127.0.0.1", port)
    except TensAtlasError as e:
        return Finding("note", str(e), "perhaps the app is running already")
    return Finding("ok", f"port {port} is free for the app")


def _chromium() -> Finding:
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if found := shutil.which(name):
            return Finding("ok", f"Chromium for figures as files and for the tests: {found}")
    return Finding(
        "note",
        "no Chromium for figures as files and for the tests",
        "the rest does without; sudo apt install chromium",
    )
