import collections
import csv
import dataclasses
import hashlib
import io
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import mujoco
import numpy as np
import pytest

from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.config import from_json, preset, replaced
from engine.control.genome import Controller
from engine.errors import ExportError, RunFileError
from engine.export import export_files, robot_hash, write_folder
from engine.fabrication.bill_of_materials import bill_of_materials
from engine.files import zip_bytes
from engine.runs.evolve import evolve
from engine.simulation.model import build_robot
from engine.storage.reader import RunReader

NAMES = {
    "README.md",
    "robot.xml",
    "controls.csv",
    "trajectory.csv",
    "play.py",
    "genotype.json",
}


EXACT = {"kernel": 1e-8, "mujoco": 0.0}
"""How far MuJoCo may be from what simulated a trial, over a second, in m."""


@pytest.fixture(scope="module", params=EXACT)
def reader(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("export") / "tiny.tsmr"
    config = replaced(preset("smoke"), evaluations=4, initial=3, batch_size=2)
    physics = dataclasses.replace(config.physics, simulator=request.param)
    evolve(path, dataclasses.replace(config, physics=physics), n_threads=1)
    with RunReader(path) as r:
        yield r


@pytest.fixture(scope="module")
def evaluation(reader):
    succeeded = [e for e in reader.all_evaluations() if e.fitness is not None]
    return min(succeeded, key=lambda e: e.solution.morphology.n_modules)


@pytest.fixture(scope="module")
def files(reader, evaluation):
    return export_files(reader, evaluation.solution.number)


@pytest.fixture(scope="module")
def model(files):
    return mujoco.MjModel.from_xml_string(files["robot.xml"].decode())


def table(content):
    return list(csv.reader(io.StringIO(content.decode())))


def figures(content):
    return np.array([[float(v) for v in row] for row in table(content)[1:]])


def test_the_same_evaluation_gives_the_same_files(reader, evaluation, files):
    assert set(files) == NAMES
    assert export_files(reader, evaluation.solution.number) == files


def test_mjcf_compiles_to_the_simulated_robot_bit_for_bit(reader, evaluation, model):
    morphology = evaluation.solution.morphology
    expected = build_robot(morphology, reader.config.physics).model
    # keyframe and numeric are what the export adds, and with them names
    added = ("key_", "numeric_", "name", "_")
    compared = 0
    for owner, other in ((model, expected), (model.opt, expected.opt)):
        for name in dir(owner):
            value = getattr(owner, name)
            if isinstance(value, np.ndarray) and not name.startswith(added):
                np.testing.assert_array_equal(value, getattr(other, name), err_msg=name)
                compared += 1
    assert compared > 300


def test_a_copy_that_mujoco_saves_has_fewer_digits_and_the_readme_says_so(files, model, tmp_path):
    ours, copy = tmp_path / "robot.xml", tmp_path / "copy.xml"
    ours.write_bytes(files["robot.xml"])
    mujoco.mj_saveLastXML(str(copy), mujoco.MjModel.from_xml_path(str(ours)))
    theirs = mujoco.MjModel.from_xml_path(str(copy))
    assert not np.array_equal(theirs.key_qpos, model.key_qpos)
    assert theirs.key_qpos == pytest.approx(model.key_qpos, abs=1e-4)
    assert "six digits" in " ".join(files["README.md"].decode().split())


def test_the_keyframe_is_where_the_dropped_robot_settles(reader, model):
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    mujoco.mj_step(model, data, round(reader.config.trials.settle_time / model.opt.timestep))
    key = model.key("settled")
    exact = EXACT[reader.config.physics.simulator]
    np.testing.assert_allclose(data.qpos, key.qpos, rtol=0, atol=exact)
    np.testing.assert_allclose(data.qvel, key.qvel, rtol=0, atol=100 * exact)
    if not exact:
        np.testing.assert_array_equal(data.qacc_warmstart, model.numeric("settled_qacc_warmstart").data)


def test_controls_are_commanded_lengths_at_every_update(reader, files, model):
    header = table(files["controls.csv"])[0]
    assert header == ["time_s", *(model.actuator(i).name for i in range(model.nu))]
    values = figures(files["controls.csv"])
    assert values.shape == (50 * reader.config.trials.trial_time, 1 + model.nu)
    np.testing.assert_allclose(values[:, 0], 0.02 * np.arange(len(values)), rtol=0, atol=1e-12)
    lengths = values[:, 1:].reshape(len(values), -1, len(t.SERVO_NODES))
    noise = 6 * t.SERVO_NOISE
    assert (lengths > servo.TARGET_LENGTHS.min(axis=0) - noise).all()
    assert (lengths < servo.TARGET_LENGTHS.max(axis=0) + noise).all()


def test_trajectory_ends_where_the_run_recorded_it(reader, evaluation, files):
    path = figures(files["trajectory.csv"])
    assert len(path) == 1 + reader.config.trials.trial_time
    np.testing.assert_array_equal(path[0, :3], 0.0)
    distance = np.linalg.norm(path[-1, 3:] - path[-1, 1:3])
    assert distance == pytest.approx(evaluation.distances[0, 0], abs=1e-12)


def test_play_repeats_the_motion_in_a_fresh_process(tmp_path, reader, files):
    # as far from the project as a stranger's computer: another folder, no path to the packages
    write_folder(files, tmp_path / "taken away")
    done = subprocess.run(
        [sys.executable, "-I", str(tmp_path / "taken away" / "play.py")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    largest = re.search(r"trajectory.csv: at most (\S+) mm", done.stdout)
    assert largest, done.stdout
    assert float(largest[1]) <= 1000 * EXACT[reader.config.physics.simulator]


def test_genotype_is_lossless(reader, evaluation, files):
    content = json.loads(files["genotype.json"])
    assert (content["format"], content["version"]) == ("tensatlas-genotype", 1)
    assert Morphology.from_json(content["morphology"]) == evaluation.solution.morphology
    assert Controller.from_json(content["controller"]) == evaluation.solution.controller
    assert content["fitness_m"] == evaluation.fitness
    assert content["f_s_cm"] == pytest.approx(45.0 - 100.0 * evaluation.fitness)
    np.testing.assert_array_equal(content["distances_m"], evaluation.distances)
    assert from_json(content["config"]) == reader.config
    assert content["run_file"] == "tiny.tsmr"
    assert content["versions"]["run"] == reader.versions


def test_bill_of_materials_counts_every_part(evaluation):
    n = evaluation.solution.morphology.n_modules
    header, *parts = table(bill_of_materials(evaluation.solution.morphology).encode())
    rows = [dict(zip(header, row, strict=True)) for row in parts]
    quantities = collections.Counter()
    for row in rows:
        quantities[row["part"].partition("_stiffness")[0]] += int(row["quantity"] or 0)
    assert quantities["plain rod"] == 5 * n
    assert quantities["servo rod"] == quantities["servomotor"] == n
    assert quantities["cap"] == 12 * n
    assert quantities["net"] == n
    assert quantities["link"] == 3 * (n - 1)
    assert all(quantities[f"internal cable to node {node}"] == n for node in (10, 9, 4, 7, 3))
    totals = {row["part"]: float(row["mass_total_g"]) for row in rows}
    assert totals["robot as simulated"] == pytest.approx(n * (20.0 + 5 * 1.003))
    carried = sum(float(r["mass_total_g"]) for r in rows[:-2] if r["group"] != "off the robot")
    assert totals["robot as built"] == pytest.approx(carried, abs=0.02)
    assert all(r["source"] for r in rows[:-2])


def test_readme_says_what_everything_is(evaluation, files):
    text = files["README.md"].decode()
    assert all(f"`{name}`" in text for name in NAMES - {"README.md"})
    assert f"f_s = **{45.0 - 100.0 * evaluation.fitness:.2f} cm**" in text
    assert "same to the last bit" in " ".join(text.split())
    assert "Nothing here has been built" in text


def test_unknown_and_failed_evaluations_are_refused(reader, evaluation, monkeypatch):
    with pytest.raises(RunFileError, match="no evaluation 99"):
        export_files(reader, 99)
    failed = dataclasses.replace(evaluation, fitness=None, failure="diverged")
    monkeypatch.setattr(reader, "evaluation", lambda _: failed)
    with pytest.raises(ExportError, match="diverged"):
        export_files(reader, 0)


def test_zip_is_deterministic_and_holds_one_folder():
    files = {"b.txt": b"2", "a.txt": b"1"}
    packed = zip_bytes(files, "robot")
    assert packed == zip_bytes(dict(reversed(files.items())), "robot")
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == {
            "robot/a.txt": b"1",
            "robot/b.txt": b"2",
        }


def test_a_new_or_empty_folder_is_filled(tmp_path):
    (tmp_path / "empty").mkdir()
    for out in (tmp_path / "empty", tmp_path / "parent" / "new"):
        write_folder({"a.txt": b"1", "sheets/b.txt": b"2"}, out)
        assert (out / "a.txt").read_bytes() == b"1"
        assert (out / "sheets" / "b.txt").read_bytes() == b"2"
        assert [p.name for p in out.parent.iterdir() if p.name.startswith(".")] == []


def test_what_is_there_already_is_left_alone(tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")
    for out in ("full", "file"):
        with pytest.raises(ExportError, match="exists already"):
            write_folder({"a.txt": b"1"}, tmp_path / out)
    with pytest.raises(ExportError, match="cannot be written"):
        write_folder({"a.txt": b"1"}, tmp_path / "file" / "below")
    assert (tmp_path / "file").read_text() == "mine"
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "full", "mine.txt"]


def test_a_failure_leaves_nothing_half_made(tmp_path, monkeypatch):
    write = Path.write_bytes

    def full_disk(path, content):
        if path.name == "b.txt":
            raise OSError(28, "No space left on device")
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", full_disk)
    with pytest.raises(ExportError, match="No space left"):
        write_folder({"a.txt": b"1", "b.txt": b"2"}, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_a_robot_with_other_sensors_or_another_network_is_another_robot(evaluation):
    solution = evaluation.solution
    former = replaced(preset("smoke"), sensors="centimetres")
    content = {
        "morphology": solution.morphology.to_json(),
        "controller": solution.controller.to_json(),
        "task": {"name": "goal-reaching"},
        "physics": {
            name: value
            for name, value in dataclasses.asdict(former.physics).items()
            if name not in ("built", "spread")
        },
    }
    del content["physics"]["feet_forward"], content["physics"]["feet_backward"]
    # as it was before there was a choice
    expected = hashlib.sha256(json.dumps(content, separators=(",", ":")).encode())
    assert robot_hash(former, solution) == expected.hexdigest()
    zero = dataclasses.replace(former.trials, unfed_outputs="zero")
    others = [replaced(former, sensors="relative"), replaced(former, trials=zero)]
    assert len({robot_hash(config, solution) for config in [former, *others]}) == 3
    assert robot_hash(replaced(former, seed=9), solution) == expected.hexdigest()


def test_feet_make_another_robot_and_so_does_their_friction(evaluation):
    config, solution = preset("smoke"), evaluation.solution
    footed = dataclasses.replace(solution, morphology=dataclasses.replace(solution.morphology, feet="end"))
    slippery = replaced(config, physics=dataclasses.replace(config.physics, feet_forward=0.2))
    assert robot_hash(slippery, solution) == robot_hash(config, solution)
    hashes = {robot_hash(c, s) for c in (config, slippery) for s in (solution, footed)}
    assert len(hashes) == 3
