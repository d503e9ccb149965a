"""A robot simulated as it would be built."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from engine.analysis.as_built import AsBuilt, Scores, as_built_facts, simulate_as_built
from engine.errors import InvalidData
from engine.simulation.built import Built, Spread
from engine.simulation.evaluation import Evaluation
from engine.simulation.physics import as_built, one_of
from engine.storage.reader import RunReader

NAMES = {"a": ("thing a", "mend a"), "b": ("thing b", "mend b"), "c": ("thing c", "mend c")}


def scores(*f_s: float | None) -> Scores:
    return Scores(f_s, None, None)


def test_what_is_kept_and_what_costs_most() -> None:
    found = AsBuilt(
        evolved=scores(0.10, 0.12),
        nominal=scores(0.08),
        robots=scores(*np.linspace(0.0, 0.10, 11), None),
        alone={"a": scores(0.10), "b": scores(0.01, 0.03), "c": scores(None)},
    )
    assert found.kept == pytest.approx(0.05 / 0.11)
    assert not found.worth_building
    assert found.worst == pytest.approx(0.01)
    assert found.robots.n_failed == 1
    assert [key for key, _ in found.costs] == ["c", "b", "a"]
    assert dict(found.costs)["b"] == pytest.approx(0.09)
    said = " ".join(found.sentences(NAMES))
    assert "Evolved 11.0 cm, as built 5.0 ± 3.3 cm." in said
    assert "Not worth building: it loses 55 %" in said
    # robots of the design lose 3 cm more than the design
    assert said.index("mend c") < said.index("mend b") < said.index("3.0 cm by how robots of the design")


def test_a_robot_that_keeps_most_of_it_is_worth_building() -> None:
    found = AsBuilt(scores(0.10), scores(0.08), scores(0.09, 0.07), {"a": scores(0.09)})
    assert found.worth_building
    assert found.sentences(NAMES)[1:] == ["Costs most: thing a (1.0 cm)."]


def test_what_costs_a_robot_that_keeps_less_than_it_should_is_said() -> None:
    found = AsBuilt(scores(0.10), scores(0.09), scores(0.07, 0.05), {"a": scores(0.09)})
    assert found.worth_building
    said = found.sentences(NAMES)[1:]
    assert said[0] == "It loses 40 % of that."
    assert said[1].startswith("3.0 cm by how robots of the design differ: evolve with --as-built --spread")
    assert said[2] == "1.0 cm by thing a: mend a."


@pytest.mark.parametrize(
    ("evolved", "robots", "said"),
    [(0.10, -0.02, "more than all"), (-0.01, -0.01, "more than all"), (0.10, None, "simulations fail")],
)
def test_a_robot_that_keeps_nothing_is_not(evolved: float, robots: float | None, said: str) -> None:
    found = AsBuilt(scores(evolved), scores(0.0), scores(robots), {})
    assert not found.worth_building
    assert said in " ".join(found.sentences(NAMES))


def test_the_same_robot_keeps_everything_and_another_does_not(small_run: Path) -> None:
    with RunReader(small_run) as reader:
        config = reader.config
        evaluation = next(e for e in map(reader.evaluation, range(10)) if e.fitness is not None)
    physics = config.physics
    varied = as_built(physics, Built(), Spread(stiffness=0.2))
    told: list[tuple[int, int]] = []
    found = simulate_as_built(
        config,
        evaluation,
        nominal=physics,
        robots=[one_of(varied, (k,)) for k in range(3)],
        alone={"slack": as_built(physics, Built(stiffness=(0.3,) * 10))},
        n_seeds=2,
        observer=lambda done, total: told.append((done, total)),
    )
    assert found.nominal.f_s == found.evolved.f_s
    assert found.alone["slack"].f_s != found.evolved.f_s
    assert len(set(found.robots.f_s)) == 3
    assert told[-1] == (9, 9)
    assert found.evolved.trajectory is not None
    assert found.evolved.trajectory.shape == evaluation.trajectory.shape
    facts = as_built_facts(found)
    assert facts["nominal"]["f_s_cm"] == facts["evolved"]["f_s_cm"]
    assert set(facts["costs_cm"]) == {"slack"}


def test_the_head_is_the_runs(small_run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with RunReader(small_run) as reader:
        config, evaluation = reader.config, reader.evaluation(0)
    other = dataclasses.replace(evaluation, head_is_end=not evaluation.head_is_end)
    seen: list[Evaluation] = []
    monkeypatch.setattr(Scores, "of", classmethod(lambda _cls, e, _d: seen.extend(e)))
    for e in (evaluation, other):
        simulate_as_built(config, e, nominal=config.physics, robots=[config.physics], alone={}, n_seeds=1)
    assert [e.head_is_end for e in seen] == [evaluation.head_is_end] * 3 + [other.head_is_end] * 3


def test_too_many_robots_are_refused(small_run: Path) -> None:
    with RunReader(small_run) as reader:
        config, evaluation = reader.config, reader.evaluation(0)
    with pytest.raises(InvalidData, match="samples must be from 1"):
        simulate_as_built(config, evaluation, nominal=config.physics, robots=[], alone={}, n_seeds=1)
