from __future__ import annotations

import dataclasses
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body.morphology import with_face, with_feet, with_modules, with_stiffness
from engine.errors import InvalidData
from engine.replay.replay import Replay
from engine.replay.what_if import WhatIf, WhatIfReplay
from engine.storage.reader import RunReader
from tests.support.made_up import examples, morphologies, per_module_morphologies

bodies = st.one_of(morphologies, per_module_morphologies())


@given(bodies, st.integers(2, 10))
@examples(60)
def test_modules_are_taken_from_the_end_or_repeat_the_last(body, n):
    changed = with_modules(body, n)
    assert changed.n_modules == n
    assert changed.stiffness_mode == body.stiffness_mode
    kept = min(n, body.n_modules)
    assert changed.faces[:kept] == body.faces[:kept]
    assert changed.stiffness_levels[:kept] == body.stiffness_levels[:kept]
    assert set(changed.faces[kept:]) <= {body.faces[-1]}
    assert set(changed.stiffness_levels[kept:]) <= {body.stiffness_levels[-1]}


@given(bodies, st.data())
@examples(60)
def test_one_gene_changes_and_no_other(body, data):
    module, face = data.draw(st.integers(0, body.n_modules - 1)), data.draw(st.integers(1, 8))
    changed = with_face(body, module, face)
    assert changed.faces[module] == face
    assert with_face(changed, module, body.faces[module]) == body
    level = data.draw(st.integers(1, 10))
    assert set(with_stiffness(body, level).stiffness_levels) == {level}
    assert with_stiffness(body, level).stiffness_mode == body.stiffness_mode
    if body.stiffness_mode == "per-module":
        changed = with_stiffness(body, level, module)
        assert changed.stiffness_levels[module] == level
        assert with_stiffness(changed, body.stiffness_levels[module], module) == body
    else:
        with pytest.raises(InvalidData, match="share one stiffness"):
            with_stiffness(body, level, module)


@given(bodies, st.integers(-3, 20))
@examples(40)
def test_what_lies_outside_is_refused(body, value):
    for allowed, change in (
        (2 <= value <= 10, lambda: with_modules(body, value)),
        (1 <= value <= 8, lambda: with_face(body, 0, value)),
        (0 <= value < body.n_modules, lambda: with_face(body, value, 1)),
        (1 <= value <= 10, lambda: with_stiffness(body, value)),
    ):
        if allowed:
            change()
        else:
            with pytest.raises(InvalidData):
                change()


def test_the_unchanged_body_does_exactly_what_was_recorded(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(2)
    what_if = WhatIf(small_reader.config, evaluation, evaluation.solution.morphology)
    seconds = []
    what_if.run(lambda: seconds.append(round(what_if.time, 3)))
    assert seconds == [1.0, 2.0]
    assert what_if.finished
    assert what_if.failure is None
    assert np.array_equal(what_if.scores, evaluation.distances)
    assert what_if.fitness == evaluation.fitness
    replay = Replay(small_reader.config, evaluation, target=2)
    replay.advance(replay.end_time)
    played = WhatIfReplay(what_if, 2)
    assert (played.start_time, played.end_time) == (replay.start_time, replay.end_time)
    assert np.array_equal(played.target, replay.target)
    assert len(played.frames) == len(replay.frames)
    for ours, theirs in zip(played.frames, replay.frames, strict=True):
        assert ours.time == pytest.approx(theirs.time)
        assert np.array_equal(ours.pose, theirs.pose)
        assert np.array_equal(ours.head, theirs.head)
        assert np.array_equal(ours.contacts, theirs.contacts)


def test_a_variant_may_have_feet_whatever_the_run_has(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(2)
    scores = []
    for feet in ("end", "start"):
        what_if = WhatIf(small_reader.config, evaluation, with_feet(evaluation.solution.morphology, feet))
        what_if.run()
        assert what_if.fitness is not None
        scores.append(what_if.scores)
    assert not np.array_equal(scores[0], evaluation.distances)
    assert not np.array_equal(*scores)


def test_a_variant_is_simulated_and_can_be_cancelled(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(2)
    body = evaluation.solution.morphology
    changed = with_modules(body, 2 if body.n_modules != 2 else 3)
    what_if = WhatIf(small_reader.config, evaluation, changed)
    what_if.run()
    assert what_if.fitness is not None
    assert not np.array_equal(what_if.scores, evaluation.distances)
    trials = dataclasses.replace(small_reader.config.trials, trial_time=1000.0)
    endless = WhatIf(dataclasses.replace(small_reader.config, trials=trials), evaluation, changed)
    thread = threading.Thread(target=endless.run)
    thread.start()
    endless.cancel()
    thread.join(30)
    assert not thread.is_alive()
    assert not endless.finished
    with pytest.raises(InvalidData, match="from 0 to 3"):
        WhatIfReplay(what_if, 4)
