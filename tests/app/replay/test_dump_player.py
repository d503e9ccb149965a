"""A failure dump on its way from the evolution to the screen."""

from __future__ import annotations

import dataclasses
import os
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.cli.main import main
from app.replay.player import Player, current_frame
from app.replay.replay_line import describe
from app.server import server
from engine.replay.dump import Dump, read_dump
from engine.replay.dump_replay import DumpReplay
from engine.simulation.physics import Physics
from tests.support.exploded import evolve
from viz.robot import robot_card


@pytest.fixture(scope="module")
def dump_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return evolve(tmp_path_factory.mktemp("exploded") / "boom.tsmr")[0]


@pytest.fixture
def dump(dump_file: Path) -> Dump:
    return read_dump(dump_file)


@pytest.fixture
def player() -> Iterator[Player]:
    player = Player()
    yield player
    player.close()


def wait_until_it_stops(player: Player) -> None:
    deadline = time.monotonic() + 30
    while player.playing:
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


def test_a_dump_plays_to_its_failure_and_again_from_its_start(player: Player, dump: Dump) -> None:
    replay = DumpReplay(dump)
    player.load(replay)
    wait_until_it_stops(player)
    assert player.time == replay.frames[-1].time == pytest.approx(0.0, abs=1e-9)
    assert current_frame(player) is replay.frames[-1]
    assert describe(player) == "0.00 s before the simulation was stopped"
    player.seek(-0.1)
    frame = current_frame(player)
    assert frame is not None
    assert frame.time == pytest.approx(-0.1, abs=replay.frame_period)
    assert describe(player).startswith("0.10 s before")
    player.seek(0.0)
    player.speed = 0.1
    player.play()
    assert player.time < -0.2
    assert player.playing
    # nothing comes after a failure
    player.speed = 8.0
    player.extend(20.0)
    wait_until_it_stops(player)
    assert player.time == replay.frames[-1].time


def test_a_dump_that_cannot_be_drawn_to_its_end_can_be_played_again(player: Player, dump: Dump) -> None:
    failed = dump.failed
    controls = failed.failure.controls.copy()
    controls[-5:, 0] = float("nan")
    failure = dataclasses.replace(failed.failure, controls=controls)
    replay = DumpReplay(dataclasses.replace(dump, failed=dataclasses.replace(failed, failure=failure)))
    player.load(replay)
    wait_until_it_stops(player)
    assert player.time == replay.frames[-1].time < -0.05
    player.speed = 0.1
    player.play()
    assert player.time < replay.frames[-1].time
    assert player.playing


def test_a_failure_that_does_not_happen_here_is_said_to(player: Player, dump: Dump) -> None:
    healthy = dataclasses.replace(dump, physics=Physics(), versions={"mujoco": "<3.9>"})
    player.load(DumpReplay(healthy))
    wait_until_it_stops(player)
    assert "it does not fail here" in describe(player)
    assert "&lt;3.9&gt;" in describe(player)


def test_the_card_says_what_is_known_and_runs_no_script(dump: Dump) -> None:
    card = robot_card.render_failure(dump)
    stage = {"settling": "settling", "head-search": "finding its head", "trial": "target"}[dump.failed.stage]
    for part in (dump.failed.failure.reason, f"Robot {dump.failed.solution.number}", stage, "mujoco"):
        assert part in card
    failure = dataclasses.replace(dump.failed.failure, reason="<script>alert(1)</script>")
    trial = dataclasses.replace(dump.failed, failure=failure, stage="trial", target=0, repeat=1)
    versions = {"mujoco": "<script>"}
    card = robot_card.render_failure(dataclasses.replace(dump, failed=trial, versions=versions))
    assert "<script" not in card
    assert "target 90° left, seed 2" in card


@pytest.mark.parametrize(("display", "n"), [(":0", 1), (None, 0)])
def test_replay_dump_serves_and_opens_a_browser_where_there_is_a_screen(
    dump_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    display: str | None,
    n: int,
) -> None:
    addresses: list[str] = []
    monkeypatch.setattr(server.webbrowser, "open", addresses.append)
    monkeypatch.setattr(server, "wait_for_interrupt", lambda: None)
    monkeypatch.setattr(server.sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if display:
        monkeypatch.setenv("DISPLAY", display)
    main(["replay-dump", str(dump_file), "--port", "0"])
    assert len(addresses) == n
    out = capsys.readouterr().out
    assert "TensAtlas is at http://127.0.0.1:" in out
    assert all(address in out for address in addresses)


BAD_FILES = {
    "missing.tsdump": (None, "No such file"),
    "empty.tsdump": (b"", "is not a failure dump"),
    "text.tsdump": (b"hello " * 100, "is not a failure dump"),
    "run.tsmr": (b"SQLite format 3\0" * 10, "is not a failure dump"),
    "zip.tsdump": (b"PK\5\6" + bytes(18), "must hold exactly"),
    "cut.tsdump": ("cut", "damaged"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_dumps_get_one_line(
    name: str,
    dump_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    content, reason = BAD_FILES[name]
    if content is not None:
        Path(name).write_bytes(dump_file.read_bytes()[:5000] if isinstance(content, str) else content)
    before = os.listdir()
    with pytest.raises(SystemExit) as e:
        main(["replay-dump", name])
    out, err = capsys.readouterr()
    assert (e.value.code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"tensatlas: {name} ")
    assert reason in err
    assert os.listdir() == before


def test_a_port_that_cannot_be_had_gets_one_line(dump_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(SystemExit) as e:
            main(["replay-dump", str(dump_file), "--port", str(port)])
    err = capsys.readouterr().err
    assert (e.value.code, err.count("\n")) == (2, 1)
    assert f"cannot listen on 127.0.0.1:{port}" in err
