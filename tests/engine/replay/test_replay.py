from __future__ import annotations

import dataclasses
import math
from typing import Any

import mujoco
import numpy as np
import pytest

from engine.control.network import Network
from engine.errors import InvalidData
from engine.replay.recording import ContactFinder
from engine.replay.replay import MAX_FRESH, Replay, repeat_trial
from engine.replay.trial import Aim, TrialChoice
from engine.simulation.model import build_robot
from engine.storage.reader import RunReader

NUMBER = 2


def replayed(reader: RunReader, **trial: Any) -> Replay:
    replay = Replay(reader.config, reader.evaluation(NUMBER), **trial)
    replay.advance(replay.trial_time)
    return replay


def test_neurons_recomputed_from_what_was_sensed_are_those_of_the_simulation(
    small_reader: RunReader, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluation = small_reader.evaluation(NUMBER)
    solution = evaluation.solution
    # the kernel shows none of its neurons
    physics = dataclasses.replace(small_reader.config.physics, simulator="mujoco")
    config = dataclasses.replace(small_reader.config, physics=physics)
    loop = repeat_trial(config, evaluation, target=1, repeat=0)
    network = Network(solution.controller, solution.morphology.n_modules)
    outputs = []
    activate = loop._network.activate
    monkeypatch.setattr(loop._network, "activate", lambda x: outputs.append(activate(x)) or outputs[-1])
    senses = []
    for _ in range(20):
        loop.update()
        assert loop.sensed is not None
        senses.append(loop.sensed[0, 0].copy())
        neurons = network.neurons(senses[-1])
        assert [neurons[k] for k in network.outputs] == outputs[-1][0, 0].tolist()
        assert set(neurons) == {*network.outputs, *network.levels}
        assert all(0.0 <= v <= 1.0 for v in neurons.values())
    replay = Replay(config, evaluation, target=1)
    replay.advance(replay.trial_time)
    told = [f.sensed for f in replay.frames if f.time > 1e-6]
    assert all(f.sensed is None for f in replay.frames if f.time < 1e-6)
    # a frame shows what was sensed at the later of its two updates
    assert [list(s) for s in told[:10] if s is not None] == [list(s) for s in senses[1::2]]


def test_contacts_are_those_that_mujoco_finds_and_lie_on_the_ground(small_reader: RunReader) -> None:
    replay = replayed(small_reader)
    assert replay.score == replay.evaluation.distances[0, 0]
    model = build_robot(replay.morphology, replay.config.physics).model
    data = mujoco.MjData(model)
    touching = [f for f in replay.frames if len(f.contacts)]
    assert len(touching) > len(replay.frames) / 2
    for frame in touching:
        assert np.abs(frame.contacts[:, 2]).max() < 0.003
        low, high = (g(frame.pose[..., :2], axis=(0, 1)) for g in (np.min, np.max))
        assert (frame.contacts[:, :2] > low - 0.05).all()
        assert (frame.contacts[:, :2] < high + 0.05).all()
        data.qpos[:] = frame.pose.ravel()
        mujoco.mj_forward(model, data)
        on_ground = data.contact.pos[(data.contact.geom == 0).any(axis=1)]
        found = ContactFinder(model).find(frame.pose.ravel())
        np.testing.assert_allclose(found, on_ground, atol=1e-7)
    # what is in the air touches nothing
    lifted = touching[-1].pose.astype(float)
    lifted[..., 2] += 0.5
    assert ContactFinder(model).find(lifted.ravel()).shape == (0, 3)


def test_fresh_noise_can_be_had_again_and_differs_from_the_evaluated(small_reader: RunReader) -> None:
    exact, first, again, other = (replayed(small_reader, fresh=k) for k in (0, 5, 5, 6))
    assert exact.score == exact.evaluation.distances[0, 0]
    assert first.score == again.score
    assert len({exact.score, first.score, other.score}) == 3
    n_settling = sum(f.time < 1e-6 for f in exact.frames)
    for a, b in zip(exact.frames[:n_settling], first.frames[:n_settling], strict=True):
        np.testing.assert_array_equal(a.pose, b.pose)
    assert (exact.frames[-1].pose != first.frames[-1].pose).any()


@pytest.mark.parametrize("fresh", [-1, MAX_FRESH + 1])
def test_fresh_noise_out_of_range_is_refused(small_reader: RunReader, fresh: int) -> None:
    with pytest.raises(InvalidData, match="fresh noise"):
        Replay(small_reader.config, small_reader.evaluation(NUMBER), fresh=fresh)


def test_a_target_where_the_task_has_one_changes_nothing(small_reader: RunReader) -> None:
    # goal reaching's first target
    aimed = replayed(small_reader, aim=Aim(90, 45))
    assert aimed.score == pytest.approx(aimed.evaluation.distances[0, 0], abs=1e-9)
    assert aimed.target_name == "90° left, 45 cm"
    assert aimed.target is not None
    assert aimed.aim_at(aimed.target) == Aim(90, 45)


def test_a_target_of_ones_own_is_where_it_was_placed_and_is_what_the_controller_senses(
    small_reader: RunReader,
) -> None:
    evaluation = small_reader.evaluation(NUMBER)
    own = Replay.of(small_reader.config, evaluation, TrialChoice(target=3, aim=Aim(-135, 80)))
    own.advance(own.trial_time)
    usual = replayed(small_reader, target=3)
    first = next(f for f in own.frames if f.sensed is not None)
    # parts of the usual 45 cm and of pi; the robot has hardly moved
    assert first.sensed == pytest.approx([80 / 45, -135 / 180], abs=0.02)
    start = next(f for f in own.frames if abs(f.time) < 1e-6)
    assert own.target is not None
    assert np.linalg.norm(own.target - start.head) == pytest.approx(0.8, abs=1e-6)
    way, known = own.target - start.head, usual.target - start.head
    turn = math.atan2(known[0] * way[1] - known[1] * way[0], known @ way)
    assert math.degrees(turn) == pytest.approx(-135 + 90, abs=1e-3)
    assert own.score == pytest.approx(np.linalg.norm(own.target - own.frames[-1].head), abs=1e-6)


def test_before_the_robot_has_settled_no_target_can_be_placed(small_reader: RunReader) -> None:
    with pytest.raises(InvalidData, match="not settled yet"):
        Replay(small_reader.config, small_reader.evaluation(NUMBER)).aim_at(np.zeros(2))
