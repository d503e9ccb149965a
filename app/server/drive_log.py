"""Serves the log of a drive beside a simulation of the robot as it would be built."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from app.drive.log import read_log
from app.drive.path import MeasuredPath
from app.server.server import Listening, Start, serve_until_interrupted
from app.session.log_session import LogSession
from engine.errors import InvalidData
from engine.fabrication.as_built import twin_of_robot
from engine.fabrication.materials import load_materials
from engine.storage.reader import RunReader


def replay_log(path: Path, run: Path, materials: str, listening: Listening) -> None:
    """Serve the log until interrupted.

    Args:
        path: the log.
        run: file of the robot's run.
        materials: preset or file that says what it is built from.
        listening: where, and whom to answer.

    Raises:
        InvalidData: as ``log_sessions``, or the token or an origin cannot be used.
        RunFileError: the run cannot be read.
        ServerError: the address cannot be listened on.
    """
    serve_until_interrupted(log_sessions(path, run, materials), listening)


def log_sessions(path: Path, run: Path, materials: str) -> Start:
    """Return what starts the session of a browser that looks at a log.

    Args:
        path: the log.
        run: file of the robot's run.
        materials: preset or file that says what it is built from.

    Raises:
        InvalidData: the file is no log or shows no path; the run has no such robot; the materials cannot be
            used.
        RunFileError: the run cannot be read.
    """
    driven, records = read_log(path)
    with RunReader(run) as reader:
        config, evaluation = reader.config, reader.evaluation(driven.robot)
    body = evaluation.solution.morphology
    if body.n_modules != driven.modules or config.task != driven.task:
        raise InvalidData(f"{path} is of another robot than number {driven.robot} of {run}")
    measured = MeasuredPath.of(records, config.trials.settle_time)
    twin = twin_of_robot(config, evaluation, load_materials(materials))
    built = dataclasses.replace(config, physics=twin.nominal)
    return lambda client, _gate, lanes: LogSession(
        client, driven, measured, built, evaluation, materials, lanes.simulating
    )
