"""The folder of one robot: build sheet, files to make its parts, firmware, data."""

from __future__ import annotations

import fnmatch
import hashlib
import importlib.metadata
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from engine.analysis.as_built import AsBuilt, as_built_facts, simulate_as_built
from engine.body import module as t
from engine.body import servo
from engine.errors import InvalidData, printable
from engine.export import export_files, simulate_trial
from engine.fabrication.as_built import Twin, twin_of
from engine.fabrication.dimensions.cable_problems import makeable
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.feet import robot_feet
from engine.fabrication.firmware import firmware_files
from engine.fabrication.folder import fabrication_files
from engine.fabrication.materials import PRESETS, Materials, preset_text
from engine.fabrication.parts.net import module_net
from engine.files import csv_text
from engine.search.archive import cell_name
from engine.simulation.provenance import versions
from engine.storage.reader import RunReader
from viz.build_sheet import style
from viz.build_sheet.facts import ArchivePlace, Facts, gather
from viz.build_sheet.kit.tiles import net_tiles
from viz.build_sheet.sheet import build_sheet
from viz.build_sheet.style import PaperName
from viz.recording.standalone_replay import standalone_replay

if TYPE_CHECKING:  # viser takes long to import, and commands do not need it
    from app.gui.file_maker import ProgressCallback

STEPS: Final = 5
ROBOTS: Final = 10
"""How many robots of the design are simulated for the sheet."""
SEEDS: Final = 3
"""Evaluations under fresh noise of the robot as evolved, as designed and with each difference alone."""
MANIFEST_FORMAT: Final = "tensatlas-manifest"
MANIFEST_VERSION: Final = 1
_PACKAGES: Final = ("reportlab", "segno", "trimesh", "manifold3d", "ezdxf", "shapely")
_TABLES: Final = ("rods.csv", "cables.csv", "joints.csv", "feet.csv")
_WHAT: Final = (
    ("build_sheet.pdf", "the build sheet: print it and start here"),
    ("README.md", "what the robot is and what each file is"),
    ("manifest.json", "hash of every file, versions, where the robot comes from"),
    ("robot.xml", "the robot in its world for MuJoCo, SI units; a copy that MuJoCo saves has fewer digits"),
    ("robot.glb", "the assembled robot to look at in 3D, in metres, y up"),
    ("replay.html", "the recorded trial as a page that plays in any browser, offline"),
    ("controls.csv", "commanded lengths of the internal cables in one trial"),
    ("trajectory.csv", "path of the head in that trial"),
    ("play.py", "plays controls.csv on robot.xml"),
    ("genotype.json", "body and controller, results, configuration, versions"),
    ("materials.toml", "what it is built from: edit it and export again with --materials"),
    ("bill_of_materials.csv", "parts with masses, and where the numbers come from"),
    ("tables/rods.csv", "cut list of the rods"),
    ("tables/cables.csv", "every passive cable"),
    ("tables/joints.csv", "orientation table: which nodes are tied"),
    ("tables/feet.csv", "which foot goes on which rod end, and where it points"),
    ("tables/internal_cables.csv", "length of the internal cables at every servo command"),
    ("tables/as_built.csv", "what differs when it is built, how that is known, and what it costs"),
    ("tables/targets.csv", "score of every trial by target"),
    ("tables/paths.csv", "recorded paths of the head towards every target"),
    ("parts/jig.*", "holds the six rods of a module while the net goes on"),
    ("parts/*.stl", "part to print, in mm"),
    ("parts/*.3mf", "part to print, units inside"),
    ("net/*.dxf", "flat net at 1:1, in mm, with a scale bar"),
    ("net/*.pdf", "flat net at 1:1 over sheets of paper with marks: print it at 100 %"),
    ("net/*.svg", "flat net at 1:1, in mm, with a scale bar"),
    ("firmware/*", "Arduino sketch with the robot's controller and its gaits"),
)


def robot_folder(
    reader: RunReader,
    number: int,
    *,
    materials: Materials,
    place: ArchivePlace | None = None,
    paper: PaperName = "a4",
    progress: ProgressCallback = lambda _doing, _n, _total: None,
) -> dict[str, bytes]:
    """Return name and content of every file of a robot's folder; equal arguments give equal bytes.

    Args:
        reader: of the run.
        number: of the evaluation.
        materials: what it is to be built from; a preset that its cables cannot be made of is replaced.
        place: archive and cell that it was found in; None to look them up.
        paper: that the build sheet is to be printed on.
        progress: told before each of ``STEPS`` steps; what it raises ends it.

    Raises:
        RunFileError: there is no such evaluation, or it is damaged.
        ExportError: its simulation failed, so that there is nothing to show.
        InvalidData: the materials' file can no longer be read.
    """
    evaluation = reader.evaluation(number)
    progress("simulating", 0, STEPS)
    trial = simulate_trial(reader.config, evaluation)
    place = place or place_of(reader, number)
    progress("simulating it as built", 1, STEPS)
    materials = makeable(evaluation.solution.morphology, materials)
    plan = robot_feet(reader.config, evaluation)
    twin = twin_of(reader.config.physics, evaluation.solution.morphology, materials, feet=plan.feet)
    as_built = simulate_as_built(
        reader.config,
        evaluation,
        nominal=twin.nominal,
        robots=twin.samples(ROBOTS),
        alone=twin.alone(),
        pairs=twin.feet_pairs(),
        n_seeds=SEEDS,
    )
    facts = gather(reader, evaluation, trial, place, twin, as_built, plan)
    files = export_files(reader, number, trial)
    progress("parts", 2, STEPS)
    for name, content in fabrication_files(facts.morphology, materials, plan.feet).items():
        files[f"tables/{name}" if name in _TABLES else name] = content
    for design in {d.level: d for d in design_cables(facts.morphology, materials)}.values():
        level = f"{design.level / t.N_STIFFNESS_LEVELS:.1f}"
        title = f"Net of stiffness {level} of {facts.name}"
        tiles, _ = net_tiles(module_net(design, materials.printer), design, style.PAPERS[paper], title)
        files[f"net/net_tiles_stiffness_{level}.pdf"] = tiles
    sketch = firmware_files(reader.config, evaluation, run=facts.run_name, as_built=twin.nominal)
    files |= {f"firmware/{name}": content for name, content in sketch.items()}
    progress("build sheet", 3, STEPS)
    files["build_sheet.pdf"] = build_sheet(facts, materials, paper)[0]
    progress("replay and tables", 4, STEPS)
    files |= {
        "materials.toml": materials_text(materials).encode(),
        "replay.html": standalone_replay(trial.replay, run=facts.run_name, where=place.name if place else ""),
        "tables/internal_cables.csv": _internal_cables(),
        "tables/targets.csv": _targets(facts),
        "tables/paths.csv": _paths(facts),
        "tables/as_built.csv": _as_built(twin, as_built),
    }
    files["README.md"] += (
        "\n## The whole folder\n\n" + list_of_files({*files, "manifest.json"}, _WHAT)
    ).encode()
    files["manifest.json"] = _manifest(reader, facts, materials, files)
    return files


def place_of(reader: RunReader, number: int) -> ArchivePlace | None:
    """Return a cell that a robot holds after the last generation, or None if it holds none."""
    last = reader.last_closed()
    for archive in last.archives if last else ():
        assert last is not None
        for cell, held in sorted(reader.placements(archive, last.number).items()):
            if held == number:
                return ArchivePlace(archive=archive, cell=cell)
    return None


def folder_name(reader: RunReader, number: int) -> str:
    """Return the default name of a robot's folder."""
    return f"{printable(reader.path.stem)}_robot_{number}"


def materials_text(materials: Materials) -> str:
    """Return the text of the file that materials were read from.

    Raises:
        InvalidData: it can no longer be read.
    """
    if materials.file in PRESETS:
        return preset_text(materials.file)
    try:
        return Path(materials.file).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as e:
        raise InvalidData(f"materials file {materials.file} cannot be read: {e}") from None


def _manifest(reader: RunReader, facts: Facts, materials: Materials, files: dict[str, bytes]) -> bytes:
    solution = facts.evaluation.solution
    made_with = versions(reader.config.task, reader.config.physics.simulator) | {
        p: importlib.metadata.version(p) for p in _PACKAGES
    }
    content: dict[str, Any] = {
        "format": MANIFEST_FORMAT,
        "version": MANIFEST_VERSION,
        "robot": {
            "id": facts.robot_id,
            "hash": facts.robot_hash,
            "run": facts.run_name,
            "run_created_at": reader.created_at,
            "archive": facts.place.archive if facts.place else None,
            "cell": cell_name(facts.place.cell) if facts.place else None,
            "evaluation": solution.number,
            "task": reader.config.task,
            "modules": facts.morphology.n_modules,
            "f_s_cm": 100 * facts.f_s,
            "as_built": None if facts.as_built is None else as_built_facts(facts.as_built),
            "link": facts.link,
        },
        "materials": materials.name,
        "versions": {"run": reader.versions, "export": made_with},
        "files": {
            name: {
                "bytes": len(files[name]),
                "sha256": hashlib.sha256(files[name]).hexdigest(),
                "what": what_is(name),
            }
            for name in sorted(files)
        },
    }
    return (json.dumps(content, indent=2, allow_nan=False) + "\n").encode()


def what_is(name: str) -> str:
    """Return the description of a file of the folder."""
    return next(what for pattern, what in _WHAT if fnmatch.fnmatch(name, pattern))


def list_of_files(names: Iterable[str], described: Sequence[tuple[str, str]]) -> str:
    """Return a folder's files for its README; names alike are listed together.

    Args:
        names: of the files.
        described: patterns of names, and what such a file is.
    """
    return "".join(
        f"- `{pattern}`: {what}.\n" for pattern, what in described if fnmatch.filter(names, pattern)
    )


def _internal_cables() -> bytes:
    header = ["command_degrees", *(f"arm_to_node_{n}_mm" for n in t.SERVO_NODES)]
    rows = [[c, *(f"{1000 * v:.4f}" for v in row)] for c, row in enumerate(servo.TARGET_LENGTHS)]
    return csv_text([header, *rows]).encode()


def _as_built(twin: Twin, found: AsBuilt) -> bytes:
    header = ["difference", "simulated", "built", "spread", "origin", "source", "costs_alone_cm"]
    costs = dict(found.costs)
    rows = [
        [
            *(d.name, d.simulated, d.built, d.spread, str(d.origin), d.source),
            f"{100 * costs[d.key]:.3f}" if d.key in costs else "",
        ]
        for d in twin.deviations
    ]
    return csv_text([header, *rows]).encode()


def _targets(facts: Facts) -> bytes:
    header = ["target", "repeat", "score_cm", "closer_by_cm"]
    start = facts.task.target_distance
    rows = [
        [name, k + 1, f"{100 * d:.4f}", f"{100 * (start - d):.4f}"]
        for name, distances in zip(facts.task.target_names, facts.evaluation.distances, strict=True)
        for k, d in enumerate(distances)
    ]
    return csv_text([header, *rows]).encode()


def _paths(facts: Facts) -> bytes:
    names = [f"{axis}_m, {name}" for name in facts.task.target_names for axis in "xy"]
    recorded = facts.evaluation.trajectory.astype(float)
    rows = [
        [s + 1, *(f"{v:.6f}" for v in np.asarray(recorded[:, s]).ravel())] for s in range(recorded.shape[1])
    ]
    return csv_text([["time_s", *names], *rows]).encode()
