from __future__ import annotations

import dataclasses
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from app.replay.player import Player, ReplayMoment, current_frame
from app.replay.replay_line import describe
from engine.errors import InvalidData
from engine.replay.replay import Replay
from engine.storage.reader import RunReader


@pytest.fixture
def shown() -> list[tuple[Replay, int]]:
    return []


@pytest.fixture
def player(shown: list[tuple[Replay, int]]) -> Iterator[Player]:
    player = Player()
    player.show_with(lambda moment: shown.append((moment.replay, moment.index)))
    yield player
    player.close()


def wait(condition: Callable[[], object], seconds: float = 30.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


def replay_of(reader: RunReader, number: int = 2, **trial: int) -> Replay:
    return Replay(reader.config, reader.evaluation(number), **trial)


def test_frames_come_in_order_up_to_the_end(
    player: Player, shown: list[tuple[Replay, int]], small_reader: RunReader
) -> None:
    replay = replay_of(small_reader)
    player.speed = 4.0
    player.load(replay)
    wait(lambda: not player.playing)
    indices = [i for r, i in shown if r is replay]
    assert indices == sorted(indices)
    assert (indices[0], indices[-1]) == (0, len(replay.frames) - 1)
    assert player.time == pytest.approx(2.0)
    frame = current_frame(player)
    assert frame is not None
    assert frame.time == pytest.approx(2.0)
    assert len(replay.frames) == 60  # 2.4 s at 25 frames a second
    assert "exactly as evaluated" in describe(player)


def test_seek_pause_loop_and_extend(player: Player, small_reader: RunReader) -> None:
    replay = replay_of(small_reader)
    player.load(replay)
    wait(lambda: replay.score is not None)
    player.pause()
    player.seek(1.0)
    wait(lambda: abs((current_frame(player) or replay.frames[0]).time - 1.0) < 0.05)
    player.seek(1e9)
    assert player.time == 2.0
    player.seek(-1e9)
    assert player.time == pytest.approx(-0.4)
    assert "settles" in describe(player)
    player.extend(1.0)
    wait(lambda: replay.frames[-1].time == pytest.approx(3.0))
    assert player.until == 3.0
    player.loop, player.speed = True, 8.0
    wait(lambda: player.time > 2.5)
    wait(lambda: player.time < 1.0)
    assert player.playing


def test_thirty_frames_a_second_lie_between_the_recorded_ones(small_reader: RunReader) -> None:
    drawn: list[tuple[float, int, float]] = []
    player = Player()
    player.show_with(lambda moment: drawn.append((time.monotonic(), moment.index, moment.time)))
    replay = replay_of(small_reader)
    player.load(replay)
    wait(lambda: replay.score is not None)
    player.speed = 0.25
    player.seek(0.5)
    player.play()
    wait(lambda: player.time > 0.6)
    drawn.clear()
    wait(lambda: player.time > 1.0)
    player.pause()
    played = drawn[:]
    times = [moment for _, _, moment in played]
    assert times == sorted(times)
    # in slow motion every frame is another one, although so many are not recorded
    assert len(set(times)) == len(times)
    assert len(times) > 2.5 * len({i for _, i, _ in played})
    assert len(played) <= 32 * (played[-1][0] - played[0][0]) + 2
    assert all(abs(t - replay.frames[i].time) <= replay.frame_period / 2 + 1e-6 for _, i, t in played)
    recorded = replay.frames[20]
    player.seek(recorded.time)
    wait(lambda: drawn[-1][1:] == (20, recorded.time))
    player.close()


def test_a_pause_that_comes_just_after_the_end_does_not_start_all_over(
    player: Player, small_reader: RunReader, monkeypatch: pytest.MonkeyPatch
) -> None:
    replay = replay_of(small_reader)
    player.load(replay)
    player.seek(replay.end_time)
    wait(lambda: not player.playing)
    monkeypatch.setattr("app.replay.player.LAG", 1e9)
    player.toggle()
    assert not player.playing
    # who has gone to another moment since does not mean to pause
    player.seek(0.5)
    player.toggle()
    assert player.playing
    player.seek(replay.end_time)
    wait(lambda: not player.playing)
    monkeypatch.setattr("app.replay.player.LAG", 0.0)
    player.toggle()
    assert player.playing
    wait(lambda: player.time < 1.0)
    player.toggle()
    assert not player.playing


def test_another_replay_takes_over_at_once(
    player: Player, shown: list[tuple[Replay, int]], small_reader: RunReader
) -> None:
    first, second = replay_of(small_reader), replay_of(small_reader, 3)
    player.load(first)
    player.load(second)
    wait(lambda: any(r is second for r, _ in shown))
    started = next(k for k, (r, _) in enumerate(shown) if r is second)
    assert all(r is second for r, _ in shown[started:])
    wait(lambda: second.score is not None)
    assert first.score is None  # it was cancelled


def test_every_trial_ends_where_it_was_evaluated(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(2)
    for target in range(4):
        replay = replay_of(small_reader, target=target)
        replay.advance(replay.trial_time)
        assert replay.score == evaluation.distances[target, 0]


@pytest.mark.parametrize("trial", [{"target": 4}, {"target": -1}, {"repeat": 1}])
def test_trials_that_do_not_exist_are_refused(small_reader: RunReader, trial: dict[str, int]) -> None:
    with pytest.raises(InvalidData):
        replay_of(small_reader, **trial)


def test_cancel_ends_a_running_simulation(small_reader: RunReader) -> None:
    replay = replay_of(small_reader)
    thread = threading.Thread(target=replay.advance, args=(1e6,))
    thread.start()
    wait(lambda: replay.frames)
    replay.cancel()
    thread.join(timeout=30)
    assert not thread.is_alive()


def test_an_odd_number_of_updates_also_ends(player: Player, small_reader: RunReader) -> None:
    """The last frame then lies one update before the end."""
    trials = dataclasses.replace(small_reader.config.trials, trial_time=1.02)
    replay = Replay(dataclasses.replace(small_reader.config, trials=trials), small_reader.evaluation(2))
    player.speed = 8.0
    player.load(replay)
    wait(lambda: not player.playing)
    assert replay.frames[-1].time == pytest.approx(1.0)
    player.play()
    assert player.time < 0.5


def test_a_closed_player_loads_nothing(player: Player, small_reader: RunReader) -> None:
    player.close()
    player.load(replay_of(small_reader))
    assert player.replay is None


def test_a_frame_that_cannot_be_shown_does_not_end_playback(small_reader: RunReader) -> None:
    fail, shown = threading.Event(), threading.Event()
    fail.set()

    def show(_moment: ReplayMoment) -> None:
        if fail.is_set():
            raise ValueError("a made-up fault")
        shown.set()

    player = Player()
    player.show_with(show)
    player.load(replay_of(small_reader))
    wait(lambda: not player.playing)
    fail.clear()
    player.play()
    assert shown.wait(30)
    player.close()


def test_nothing_is_at_work_after_closing(player: Player, small_reader: RunReader) -> None:
    others = set(threading.enumerate())
    mine = Player()
    mine.load(replay_of(small_reader))
    mine.extend(60.0)
    wait(lambda: mine.time > -0.2)
    mine.close()
    assert [t.name for t in threading.enumerate() if t not in others] == []
