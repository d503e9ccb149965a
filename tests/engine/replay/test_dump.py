"""Failed simulations as files: written beside a run, read with suspicion, simulated again."""

import dataclasses
import io
import json
import os
import zipfile

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import engine.replay.dump
import engine.runs.evolve
from engine.body.morphology import Morphology
from engine.errors import DumpError
from engine.files import zip_bytes
from engine.replay.dump import Dump, DumpFolder, read_dump, write_dump
from engine.replay.dump_replay import DumpReplay
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.physics import Physics
from engine.simulation.trials import TrialConfig
from engine.storage.reader import RunReader
from engine.tasks import GOAL_REACHING
from tests.support.made_up import TINY, evolved_controller, examples

EXPLOSIVE = Physics(timestep=0.004)
"""A time step that the cables' damping does not bear: stiff robots fly apart first."""

CONFIG = dataclasses.replace(
    TINY,
    physics=EXPLOSIVE,
    trials=TrialConfig(repeats=2, settle_time=1.0, open_loop_time=1.0, trial_time=1.0),
)
BODIES = [Morphology(10, (1, 2, 3, 4, 5)), Morphology(10, (1, 1)), Morphology(3, (2, 3, 2, 7))]


def solutions():
    return [
        Solution(number=20 + k, morphology=m, controller=evolved_controller(k, 3))
        for k, m in enumerate(BODIES)
    ]


def evaluate(keep=None, n_threads=1, of=None):
    evaluator = LocalEvaluator(
        task=GOAL_REACHING,
        physics=EXPLOSIVE,
        trials=CONFIG.trials,
        run_seed=1,
        n_threads=n_threads,
        keep_failure=keep,
    )
    found = [e for group in evaluator.evaluate(of or solutions()) for e in group]
    return {e.solution.number: e for e in found}


@pytest.fixture(autouse=True)
def any_time_step(monkeypatch):
    """Let runs start with a time step that they refuse."""
    monkeypatch.setattr(engine.runs.evolve, "check_timestep", lambda _physics: None)


@pytest.fixture(scope="module")
def failures():
    """What failed in three evaluations."""
    kept = []
    evaluate(lambda failed: kept.append(failed) or "")
    assert len(kept) >= 2
    return kept


@pytest.fixture(scope="module")
def dump(failures):
    longest = max(failures, key=lambda failed: failed.failure.n_updates)
    return Dump("goal-reaching", EXPLOSIVE, 1, longest, {"mujoco": "4.0.0", "tensatlas": "0.1.0"})


@pytest.fixture(scope="module")
def packed(dump, tmp_path_factory):
    path = tmp_path_factory.mktemp("packed") / "a.tsdump"
    write_dump(dump, path)
    return path.read_bytes()


def test_a_dump_reads_back_to_the_last_bit(failures, tmp_path):
    for failed in failures:
        path = tmp_path / "a.tsdump"
        write_dump(Dump("goal-reaching", EXPLOSIVE, 1, failed, {"mujoco": "4.0.0"}), path)
        again = read_dump(path)
        assert (again.task, again.physics, again.run_seed) == ("goal-reaching", EXPLOSIVE, 1)
        assert again.versions == {"mujoco": "4.0.0"}
        other = again.failed
        for name in ("head_is_end", "stage", "target", "repeat"):
            assert getattr(other, name) == getattr(failed, name)
        assert other.solution.morphology == failed.solution.morphology
        assert other.solution.controller == failed.solution.controller
        assert other.solution.number == failed.solution.number
        assert (other.failure.reason, other.failure.n_updates) == (
            failed.failure.reason,
            failed.failure.n_updates,
        )
        assert other.failure.state.tobytes() == failed.failure.state.tobytes()
        assert other.failure.controls.tobytes() == failed.failure.controls.tobytes()
    assert [p.name for p in tmp_path.iterdir()] == ["a.tsdump"]


def test_a_dump_simulated_again_explodes_again(failures):
    for failed in failures:
        replay = DumpReplay(Dump("goal-reaching", EXPLOSIVE, 1, failed, {}))
        replay.advance()
        assert replay.reproduced is True
        assert replay.failure == failed.failure.reason
        n = len(failed.failure.controls)
        assert len(replay.frames) == 1 + n * EXPLOSIVE.steps_per_control
        times = [f.time for f in replay.frames]
        np.testing.assert_allclose(np.diff(times), EXPLOSIVE.timestep)
        assert times[0] == pytest.approx(-n * EXPLOSIVE.control_period)
        assert times[-1] == pytest.approx(0.0, abs=1e-9)
        poses = np.array([f.pose[..., :3] for f in replay.frames])
        assert np.isfinite(poses).all()
        speed = np.linalg.norm(np.diff(poses, axis=0), axis=-1).max(axis=(1, 2)) / EXPLOSIVE.timestep
        assert speed[-EXPLOSIVE.steps_per_control :].max() > 5.0
        assert speed[-EXPLOSIVE.steps_per_control :].max() > 3 * np.median(speed)


def test_what_cannot_be_drawn_is_no_frame(dump):
    failed = dump.failed
    controls = failed.failure.controls.copy()
    controls[5, 3] = np.nan
    broken = dataclasses.replace(failed.failure, controls=controls[:6], reason="x", n_updates=6)
    replay = DumpReplay(dataclasses.replace(dump, failed=dataclasses.replace(failed, failure=broken)))
    replay.advance()
    assert replay.reproduced is True
    assert len(replay.frames) == 1 + 5 * EXPLOSIVE.steps_per_control


def test_a_dump_that_does_not_fail_here_says_so(dump):
    healthy = dataclasses.replace(dump, physics=Physics())
    replay = DumpReplay(healthy)
    replay.advance()
    assert replay.reproduced is False
    assert replay.failure == dump.failed.failure.reason


def test_a_cancelled_replay_simulates_nothing(dump):
    replay = DumpReplay(dump)
    replay.cancel()
    replay.advance()
    assert (replay.frames, replay.failure) == ([], None)


def test_the_mjcf_in_a_dump_explodes_outside_tensatlas(dump, packed):
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        model = mujoco.MjModel.from_xml_string(archive.read("robot.xml").decode())
        controls = np.load(io.BytesIO(archive.read("controls.npy")), allow_pickle=False)
        state = np.load(io.BytesIO(archive.read("state.npy")), allow_pickle=False)
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    assert data.qpos == pytest.approx(model.key("before_failure").qpos, abs=1e-12)
    fastest = 0.0
    for row in controls:
        data.ctrl[:] = row
        mujoco.mj_step(model, data, EXPLOSIVE.steps_per_control)
        fastest = max(fastest, np.abs(data.qvel.reshape(-1, 6)[:, :3]).max())
    assert fastest > 5.0


def test_a_library_user_gets_no_files_and_the_plain_reason(failures, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plain = evaluate(n_threads=2)
    for failed in failures:
        assert plain[failed.solution.number].failure == failed.failure.reason
        assert plain[failed.solution.number].fitness is None
    assert not list(tmp_path.iterdir())


def test_keeping_failures_changes_no_figure(failures):
    plain, kept = evaluate(), evaluate(lambda _failed: " (kept)", n_threads=2)
    for number, e in plain.items():
        assert kept[number].distances.tobytes() == e.distances.tobytes()
        assert kept[number].trajectory.tobytes() == e.trajectory.tobytes()
        assert kept[number].failure == (e.failure and e.failure + " (kept)")


def folder_of(path, n_failed=0):
    return DumpFolder(path, config=CONFIG, versions={}, n_failed=n_failed)


def test_dumps_are_limited(failures, tmp_path, monkeypatch):
    monkeypatch.setattr(engine.replay.dump, "MAX_DUMPS", 3)
    dumps = folder_of(tmp_path / "d", n_failed=1)
    said = []
    for number in range(4):
        solution = dataclasses.replace(failures[0].solution, number=number)
        said.append(dumps.keep(dataclasses.replace(failures[0], solution=solution)))
    names = sorted(p.name for p in (tmp_path / "d").iterdir())
    assert len(names) == 2
    assert said == [f" (dumped to {names[0]})", f" (dumped to {names[1]})", "", ""]


def test_a_folder_that_cannot_be_written_is_no_reason_to_stop(failures, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    said = folder_of(tmp_path / "file").keep(failures[0])
    assert said == " (not dumped: File exists)"
    # the name of the dump is taken by a folder
    name = Dump("goal-reaching", EXPLOSIVE, 0, failures[0], {}).file_name
    (tmp_path / "d" / name).mkdir(parents=True)
    assert folder_of(tmp_path / "d").keep(failures[0]) == " (not dumped: Is a directory)"
    assert [p.name for p in (tmp_path / "d").iterdir()] == [name]


def test_a_full_disk_is_no_reason_to_stop(failures, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert folder_of(tmp_path / "d").keep(failures[0]) == " (not dumped: No space left on device)"
    assert not list((tmp_path / "d").iterdir())


def texts(path):
    with RunReader(path) as reader:
        return {e.solution.number: e.failure for e in reader.all_evaluations()}, reader.canonical_hash()


def test_a_run_keeps_its_failures_the_same_ones_whatever_happens(tmp_path, monkeypatch):
    monkeypatch.setattr(engine.replay.dump, "MAX_DUMPS", 4)
    config = dataclasses.replace(CONFIG, trials=dataclasses.replace(CONFIG.trials, repeats=1))

    def stop(progress):
        if progress.n_evaluations >= 3:
            raise KeyboardInterrupt

    engine.runs.evolve.evolve(tmp_path / "a.tsmr", config, n_threads=1)
    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(tmp_path / "b.tsmr", config, n_threads=2, observer=stop)
    engine.runs.evolve.resume(tmp_path / "b.tsmr", n_threads=2)
    assert texts(tmp_path / "a.tsmr") == texts(tmp_path / "b.tsmr")
    said = [f for f in texts(tmp_path / "a.tsmr")[0].values() if f]
    assert len(said) > 4
    a, b = (
        {p.name: p.read_bytes() for p in (tmp_path / f"{name}.failures").iterdir()} for name in ("a", "b")
    )
    assert a == b
    assert len(a) == 4
    assert sorted(f.split("(dumped to ")[1].rstrip(")") for f in said if "dumped" in f) == sorted(a)
    for name in a:
        replay = DumpReplay(read_dump(tmp_path / "a.failures" / name))
        replay.advance()
        assert replay.reproduced is True


def test_a_run_without_failures_leaves_no_folder(simulated_run):
    assert not engine.storage.schema.failures_folder(simulated_run).exists()


def test_a_run_goes_on_where_nothing_can_be_dumped(tmp_path):
    config = dataclasses.replace(CONFIG, trials=dataclasses.replace(CONFIG.trials, repeats=1))
    (tmp_path / "a.failures").write_text("in the way")
    engine.runs.evolve.evolve(tmp_path / "a.tsmr", config, n_threads=2)
    said, _ = texts(tmp_path / "a.tsmr")
    assert len(said) == config.evaluations
    assert any("(not dumped: File exists)" in f for f in said.values() if f)


def refused(path, content):
    path.write_bytes(content)
    with pytest.raises(DumpError) as e:
        read_dump(path)
    assert str(e.value).startswith(str(path))
    assert "\n" not in str(e.value)
    return str(e.value)


def read_or_refused(path):
    """Read a dump that may be bad; only a refusal of one line is allowed."""
    said = ""
    try:
        read_dump(path)
    except DumpError as e:
        said = str(e)
    assert not said or said.startswith(str(path))
    assert "\n" not in said


def changed(packed, change):
    """Return a dump whose members, by name, were changed; its failure.json comes as a table."""
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        files = {n: archive.read(n) for n in archive.namelist()}
    table = json.loads(files["failure.json"])
    change(files, table)
    if "failure.json" in files and files["failure.json"].startswith(b"{"):
        files["failure.json"] = json.dumps(table).encode()
    return zip_bytes(files)


def test_a_dump_from_before_there_were_walls_is_read(packed, dump, tmp_path):
    path = tmp_path / "old.tsdump"
    path.write_bytes(changed(packed, lambda _files, table: (table.update(version=1), table.pop("walls"))))
    again = read_dump(path)
    assert again.failed.walls == ()
    assert again.failed.failure.state.tobytes() == dump.failed.failure.state.tobytes()


def put(**values):
    return lambda _files, table: table.update(values)


def put_file(name, content):
    return lambda files, _table: files.update({name: content})


def grow(files, table):
    files["robot.xml"] = bytes(engine.replay.dump.MAX_BYTES + 1)


def spoil(files, table):
    header, numbers = files["state.npy"][:128], np.frombuffer(files["state.npy"], "<f8", offset=128).copy()
    numbers[3] = np.nan
    files["state.npy"] = header + numbers.tobytes()


def pickle_instead(files, table):
    b = io.BytesIO()
    np.save(b, np.array([{}], dtype=object), allow_pickle=True)
    files["state.npy"] = b.getvalue()


def cut_short(files, table):
    files["controls.npy"] = files["controls.npy"][:-8]


def claim_more(files, table):
    files["state.npy"] = files["state.npy"].replace(b"'shape': (", b"'shape': (9", 1)[:-1]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (put(format="other"), "of another program"),
        (put(version=3), "newer TensAtlas"),
        (put(extra=1), "exactly the keys"),
        (lambda _files, table: table.pop("physics"), "exactly the keys"),
        (put(number=-1), "number must be"),
        (put(number=True), "number must be"),
        (put(morphology={"stiffness_level": 5, "faces": [1] * 11}), "number of modules"),
        (put(morphology={"stiffness_level": 5, "faces": [1, 1, 1]}), "array"),
        (put(controller=[]), "controller"),
        (put(head_is_end=1), "head_is_end"),
        (put(stage="sleeping"), "stage"),
        (put(stage=["trial"]), "stage"),
        (put(stage="trial", target=4, repeat=0), "target must be"),
        (put(stage="trial", target=0, repeat=None), "repeat must be"),
        (put(stage="settling", target=0), "only a trial"),
        (put(reason="two\nlines"), "one line"),
        (put(reason="x" * 501), "one line"),
        (put(n_updates=1), "control updates"),
        (put(n_updates=0), "control updates"),
        (put(task="flying"), "unknown task"),
        (put(walls=[[0.0] * 7]), "half_size must be at least"),
        (put(walls=[[0.0] * 6]), "seven numbers"),
        (put(walls=[[0, 0, 0, 1, 1, 1, "0"]]), "seven numbers"),
        (put(walls=[[0, 0, float("nan"), 1, 1, 1, 0]]), "three numbers"),
        (put(walls=[[0, 0, 0, 1, 1, 1, 0]] * 65), "at most 64"),
        (put(walls=None), "walls must be"),
        (put(physics={"timestep": -1.0}), "timestep must be positive"),
        (put(physics={"timestep": "1"}), "expected float"),
        (put(physics={"gravity": 1.0}), "unknown 'gravity'"),
        (put(run_seed=2**40), "run_seed"),
        (put(versions={"mujoco": 4}), "one line"),
        (put(versions={str(k): "" for k in range(51)}), "versions"),
        (put_file("failure.json", b"[" * 10_000), "damaged"),
        (put_file("failure.json", b"\xff"), "damaged"),
        (lambda files, _table: files.pop("robot.xml"), "exactly"),
        (put_file("../x", b""), "exactly"),
        (put_file("state.npy", b""), "array"),
        (cut_short, "array"),
        (grow, "too large"),
        (spoil, "finite numbers"),
        (pickle_instead, "array"),
        (claim_more, "array"),
    ],
)
def test_impossible_dumps_get_one_line(packed, tmp_path, change, reason):
    assert reason in refused(tmp_path / "bad.tsdump", changed(packed, change))


def test_no_dump_at_all_gets_one_line(packed, tmp_path):
    bad = tmp_path / "bad.tsdump"
    for content in (b"", b"hello", packed[1:]):
        assert "is not a failure dump" in refused(bad, content)
    assert "damaged" in refused(bad, packed[:-30])
    assert "too large" in refused(bad, bytes(engine.replay.dump.MAX_BYTES + 1))
    for path in (tmp_path / "missing.tsdump", tmp_path):
        with pytest.raises(DumpError, match="cannot be read"):
            read_dump(path)


@examples(300)
@given(st.data())
def test_a_dump_with_any_bytes_changed_is_read_or_refused(packed, tmp_path, data):
    content = bytearray(packed)
    for _ in range(data.draw(st.integers(1, 4))):
        where = data.draw(st.integers(0, len(content) - 1))
        kind = data.draw(st.sampled_from(["set", "insert", "delete", "cut"]))
        if kind == "set":
            content[where] = data.draw(st.integers(0, 255))
        elif kind == "insert":
            content[where:where] = data.draw(st.binary(min_size=1, max_size=8))
        elif kind == "delete":
            del content[where : where + data.draw(st.integers(1, 40))]
        else:
            del content[where:]
        if not content:
            break
    path = tmp_path / "bad.tsdump"
    path.write_bytes(content)
    read_or_refused(path)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=8,
)


@examples(300)
@given(st.data())
def test_a_dump_with_any_value_changed_is_read_or_refused(packed, tmp_path, data):
    """Past the checksums: well-made archives of nonsense, at any depth of failure.json."""

    def change(files, table):
        at, key = table, data.draw(st.sampled_from(sorted(table)))
        while isinstance(at[key], dict | list) and at[key] and data.draw(st.booleans()):
            at = at[key]
            key = data.draw(
                st.sampled_from(sorted(at)) if isinstance(at, dict) else st.integers(0, len(at) - 1)
            )
        at[key] = data.draw(json_values)

    path = tmp_path / "bad.tsdump"
    path.write_bytes(changed(packed, change))
    read_or_refused(path)
