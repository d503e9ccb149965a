import dataclasses
import json
import os
import subprocess
import sys
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.errors import RunFileError
from engine.storage.lock import SILENCE, Holder, RunLock, boot_id, holder_of, is_being_written, lock_path
from engine.storage.writer import RunWriter
from tests.support.made_up import MADE_UP, examples

ELSEWHERE = Holder(
    pid=4711, host="elsewhere", boot="another", since="2026-01-01T00:00:00+00:00", command="x", key="1"
)


def leave(path, holder, seconds_ago=0.0):
    """Leave a lock file behind, as a process that was killed would."""
    lock_path(path).write_text(json.dumps(dataclasses.asdict(holder)))
    then = time.time() - seconds_ago
    os.utime(lock_path(path), (then, then))


def test_the_holder_is_named(tmp_path):
    lock = RunLock.acquire(tmp_path / "run.tsmr")
    holder = holder_of(tmp_path / "run.tsmr")
    assert (holder.pid, holder.boot) == (os.getpid(), boot_id())
    assert holder.is_here
    assert holder.is_of_this_boot
    with pytest.raises(RunFileError, match=rf"another process \({os.getpid()} on .* since 20.*: .*\)"):
        RunLock.acquire(tmp_path / "run.tsmr")
    lock.release()
    assert holder_of(tmp_path / "run.tsmr") is None
    lock.release()  # once more does nothing
    assert os.listdir(tmp_path) == []


def test_a_lock_whose_process_is_gone_is_free(tmp_path):
    path = tmp_path / "run.tsmr"
    code = (
        "import sys, os, signal; from pathlib import Path; from engine.storage.lock import RunLock;"
        "lock = RunLock.acquire(Path(sys.argv[1])); os.kill(os.getpid(), signal.SIGKILL)"
    )
    dead = subprocess.run([sys.executable, "-c", code, path], check=False)
    assert dead.returncode == -9
    assert holder_of(path).pid > 0
    assert not is_being_written(path)
    RunLock.acquire(path).release()


@pytest.mark.parametrize(
    "changes",
    [{"boot": "before-the-restart"}, {"boot": ""}, {"host": "a-container-with-a-name-of-its-own"}],
    ids=str,
)
def test_a_lock_of_this_machine_from_before_a_restart_is_free(tmp_path, changes):
    path = tmp_path / "run.tsmr"
    own = RunLock.acquire(path)
    holder = holder_of(path)
    own.release()
    leave(path, dataclasses.replace(holder, **changes))
    assert holder_of(path).is_here
    assert not is_being_written(path)
    RunLock.acquire(path).release()


def test_a_lock_of_another_machine_holds_until_it_has_been_silent(tmp_path):
    path = tmp_path / "run.tsmr"
    leave(path, ELSEWHERE, 30.0)
    assert is_being_written(path)
    before = lock_path(path).stat().st_mtime
    with pytest.raises(RunFileError, match=r"another machine, or was 3\d s ago \(4711 on elsewhere.*delete"):
        RunLock.acquire(path)
    # asking is no sign of life
    assert lock_path(path).stat().st_mtime == pytest.approx(before)
    leave(path, ELSEWHERE, SILENCE + 5.0)
    assert not is_being_written(path)
    RunLock.acquire(path).release()


def test_a_holder_gives_signs_of_life(tmp_path, monkeypatch):
    monkeypatch.setattr("engine.storage.lock.BEAT", 0.02)
    path = tmp_path / "run.tsmr"
    lock = RunLock.acquire(path)
    os.utime(lock_path(path), (0.0, 0.0))
    deadline = time.monotonic() + 20.0
    while lock_path(path).stat().st_mtime < 1.0:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    lock.release()


@pytest.mark.parametrize("taken", [True, False])
def test_a_writer_whose_lock_was_removed_or_taken_stops(tmp_path, taken):
    path = tmp_path / "run.tsmr"
    writer = RunWriter.create(path, MADE_UP, {})
    lock_path(path).unlink()
    other = RunWriter.open(path) if taken else None
    said = rf"another process writes the run now \({os.getpid()} on" if taken else "lock file was removed"
    with pytest.raises(RunFileError, match=said):
        writer.add_evaluations(0, [])
    if other is not None:
        other.add_evaluations(0, [])
    writer.close()
    if other is not None:
        assert lock_path(path).exists()
        other.close()
    assert os.listdir(tmp_path) == ["run.tsmr"]


TEXTS = ("host", "boot", "since", "command", "key")
said = st.recursive(st.none() | st.integers() | st.text(), st.lists)


@examples(50)
@given(
    st.binary(max_size=200)
    | st.fixed_dictionaries(dict.fromkeys(("pid", *TEXTS), said)).map(lambda v: json.dumps(v).encode())
)
def test_whatever_a_lock_file_says_it_is_one_line(tmp_path, content):
    path = tmp_path / "run.tsmr"
    lock_path(path).write_bytes(content)
    holder = holder_of(path)
    assert holder is None or str(holder).isprintable()
    is_being_written(path)


@examples(50)
@given(st.integers(1, 2**31 - 1), st.fixed_dictionaries(dict.fromkeys(TEXTS, said)))
def test_a_holder_is_one_line_whatever_it_is_called(tmp_path, pid, texts):
    path = tmp_path / "run.tsmr"
    lock_path(path).write_text(json.dumps({"pid": pid, **texts}))
    holder = holder_of(path)
    assert holder.pid == pid
    assert str(holder).isprintable()
    assert len(str(holder)) < 700


def test_a_holder_cannot_break_its_line(tmp_path):
    path = tmp_path / "run.tsmr"
    leave(path, dataclasses.replace(ELSEWHERE, host="a\nb", command="\x1b[2Jrm\u2028x"))
    assert (holder_of(path).host, holder_of(path).command) == ("a?b", "?[2Jrm?x")
