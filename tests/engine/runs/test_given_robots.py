"""Runs that start from given robots."""

import dataclasses
import json

import pytest

import engine.runs.evolve
from engine.analysis.elite_table import elite_table, write_table
from engine.analysis.evaluation_table import evaluation_table
from engine.analysis.given_robots import read_robots
from engine.body.morphology import Morphology
from engine.config import create_algorithm, replaced
from engine.errors import InvalidData, RunFileError
from engine.search.variation import GivenRobot
from engine.storage.check import check_run
from engine.storage.migration import slim
from engine.storage.reader import RunReader
from engine.storage.recovery import recover
from engine.tasks import get_task
from tests.support.made_up import MADE_UP, MadeUpEvaluator, evolved_controller
from tests.support.run_formats import change
from tests.support.run_hash import hash_of

SMALL = replaced(MADE_UP, evaluations=44, refit_generations=(0, 2))
ROBOTS = [
    GivenRobot(Morphology(3 + i, (1, 2, 3 + i)), evolved_controller(i, 12), f"other.tsmr robot {i}")
    for i in range(3)
]


@pytest.fixture(autouse=True)
def _no_physics(monkeypatch):
    monkeypatch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: MadeUpEvaluator())


def evolve(path, *, given=ROBOTS, until=None, **changes):
    def interrupt(progress):
        if until is not None and progress.n_evaluations >= until:
            raise KeyboardInterrupt

    config = replaced(SMALL, **changes)
    if until is None:
        engine.runs.evolve.evolve(path, config, given=given)
    else:
        with pytest.raises(KeyboardInterrupt):
            engine.runs.evolve.evolve(path, config, given=given, observer=interrupt)
    return path


KINDS = [
    {},
    {"algorithm": "map-elites"},
    {"cell_capacity": 5},
    {"algorithm": "random"},
    {"overlap": 2},
]


@pytest.mark.parametrize("changes", KINDS, ids=str)
def test_given_robots_are_evaluated_first_and_recorded_as_such(tmp_path, changes):
    path = evolve(tmp_path / "run.tsmr", **changes)
    with RunReader(path) as reader:
        first = [e.solution for e in reader.all_evaluations()[:20]]
        assert reader.given() == ROBOTS
        assert all(e.solution.operator != "given" for e in reader.all_evaluations()[3:])
    for k, (s, robot) in enumerate(zip(first, ROBOTS, strict=False)):
        assert (s.number, s.operator, s.source, s.parent) == (k, "given", robot.origin, None)
        assert (s.morphology, s.controller) == (robot.morphology, robot.controller)
    assert [s.operator for s in first[3:]] == ["random"] * 17
    # in place of the first random ones: those that follow are the first that the seed draws
    drawn = create_algorithm(replaced(SMALL, **changes)).ask()[:17]
    for s, other in zip(first[3:], drawn, strict=True):
        assert (s.morphology, s.controller) == (other.morphology, other.controller)


def test_mutants_get_numbers_of_nodes_and_links_that_no_given_robot_has(tmp_path):
    parent = evolved_controller(7, 40)
    highest = max(n.key for n in parent.nodes), max(link.innovation for link in parent.connections)
    assert highest > (23, 66)
    given = [GivenRobot(Morphology(5, (1, 2)), parent, "x")]
    path = evolve(tmp_path / "run.tsmr", given=given)
    with RunReader(path) as reader:
        old = {(link.source, link.target, link.innovation) for link in parent.connections}
        old_nodes = {n.key for n in parent.nodes}
        for e in reader.all_evaluations()[20:]:
            c = e.solution.controller
            assert all(n.key <= 22 or n.key in old_nodes or n.key > highest[0] for n in c.nodes)
            for link in c.connections:
                key = link.source, link.target, link.innovation
                assert key in old or link.innovation <= 66 or link.innovation > highest[1]


@pytest.mark.parametrize("until", [2, 10, 30])
def test_an_interrupted_run_goes_on_as_if_it_had_not_been(tmp_path, until):
    whole = hash_of(evolve(tmp_path / "whole.tsmr"))
    path = evolve(tmp_path / "cut.tsmr", until=until)
    engine.runs.evolve.resume(path)
    assert hash_of(path) == whole
    assert hash_of(evolve(tmp_path / "again.tsmr")) == whole
    assert hash_of(evolve(tmp_path / "other.tsmr", given=ROBOTS[:2])) != whole


def test_recovering_and_slimming_keep_them(tmp_path):
    path, out = evolve(tmp_path / "run.tsmr"), tmp_path / "new.tsmr"
    broken = tmp_path / "broken.tsmr"
    broken.write_bytes(path.read_bytes())
    change(broken, *(f"DELETE FROM {table} WHERE number = 1" for table in ("evaluations", "details")))
    assert recover(broken, out).missing == [1]
    engine.runs.evolve.resume(out)
    assert hash_of(out) == hash_of(path)
    assert not [f for f in check_run(out) if f.verdict == "problem"]
    slim(path, tmp_path / "slim.tsmr")
    with RunReader(tmp_path / "slim.tsmr") as reader:
        assert reader.evaluation(0).solution.source == ROBOTS[0].origin


@pytest.mark.parametrize(
    ("changes", "robot", "said"),
    [
        ({"algorithm": "vie-neat"}, {}, "vie-neat pairs bodies with controllers anew"),
        ({"stiffness": "per-module"}, {}, "--stiffness shared; this one has per-module"),
        ({"head_search": "rhythms"}, {}, "--head-search together; this one has rhythms"),
        ({}, {"controller": evolved_controller(0, 0, n_inputs=3)}, "other.tsmr robot 0 senses 3 numbers"),
        ({"initial": 2}, {}, r"initial \(2\) must be at least the number of robots .* \(3\)"),
    ],
    ids=str,
)
def test_robots_that_do_not_fit_are_refused_before_a_file_is_made(tmp_path, changes, robot, said):
    given = [dataclasses.replace(ROBOTS[0], **robot), *ROBOTS[1:]]
    if changes.get("algorithm") == "vie-neat":
        changes = {**changes, "evaluations": 1000}
    with pytest.raises(InvalidData, match=said) as e:
        evolve(tmp_path / "run.tsmr", given=given, **changes)
    assert "\n" not in str(e.value)
    assert list(tmp_path.iterdir()) == []


def test_robots_with_numbers_without_end_are_refused(tmp_path):
    c = ROBOTS[0].controller
    far = dataclasses.replace(c, connections=(dataclasses.replace(c.connections[0], innovation=2**50),))
    with pytest.raises(InvalidData, match="robot 0 has a node or an innovation with a number above"):
        evolve(tmp_path / "run.tsmr", given=[dataclasses.replace(ROBOTS[0], controller=far)])


def test_damaged_robots_are_one_line(tmp_path):
    path = evolve(tmp_path / "run.tsmr", until=5)
    change(path, "UPDATE meta SET value = '[{}]' WHERE key = 'given'")
    with pytest.raises(RunFileError, match="is damaged"):
        engine.runs.evolve.resume(path)


# ---- where robots are read from


def read(sources, task="goal-reaching"):
    return read_robots(sources, get_task(task))


@pytest.fixture
def other(tmp_path):
    return evolve(tmp_path / "other.tsmr", given=[])


def test_elites_of_another_run(other):
    with RunReader(other) as reader:
        placed = reader.placements("morphology", reader.last_generation())
        elites = [reader.evaluation(n).solution for n in sorted(set(placed.values()))]
    found = read([str(other)])
    assert [(r.morphology, r.controller) for r in found] == [(s.morphology, s.controller) for s in elites]
    assert [r.origin for r in found] == [f"other.tsmr robot {s.number}" for s in elites]
    cells = list(placed)[3], list(placed)[1]
    chosen = read([f"{other}:{','.join(map(str, cells[0]))}:{','.join(map(str, cells[1]))}"])
    assert [r.origin for r in chosen] == [f"other.tsmr robot {placed[c]}" for c in cells]
    # each once, in their order
    assert read([str(other), str(other)]) == found


def test_robots_of_another_task_keep_the_inputs_that_both_have(other):
    found, as_they_were = read([str(other)], "squeezing"), read([str(other)])
    names = get_task("goal-reaching").inputs, get_task("squeezing").inputs
    assert [r.controller for r in found] == [r.controller.sensing(*names) for r in as_they_were]
    assert [r.origin for r in found] == [r.origin for r in as_they_were]
    algorithm = create_algorithm(replaced(SMALL, task="squeezing"), found[:4])
    assert [(s.morphology, s.controller) for s in algorithm.ask()[:4]] == [
        (r.morphology, r.controller) for r in found[:4]
    ]


def test_robots_of_another_run_by_their_numbers(other):
    with RunReader(other) as reader:
        robots = {n: reader.evaluation(n).solution for n in (43, 2, 17)}
    found = read([f"{other}#43,2", f"{other}#17"])
    assert [(r.morphology, r.controller) for r in found] == [
        (s.morphology, s.controller) for s in robots.values()
    ]
    assert [r.origin for r in found] == [f"other.tsmr robot {n}" for n in robots]


@pytest.mark.parametrize("name", ["all.csv", "all.parquet"])
def test_rows_of_a_table(other, tmp_path, name):
    with RunReader(other) as reader:
        write_table(evaluation_table(reader), tmp_path / name)
        write_table(elite_table(reader, "morphology"), tmp_path / f"elites-{name}")
    found = read([str(tmp_path / name)])
    assert len({r.origin for r in found}) == len(found) <= 44
    assert found[0].origin == f"{name} row 1"
    elites = read([str(tmp_path / f"elites-{name}")])
    assert {r.controller for r in elites} == {r.controller for r in read([str(other)])}


def test_genotype_files(tmp_path):
    path = tmp_path / "genotype.json"
    path.write_text(json.dumps({**ROBOTS[0].to_json(), "f_s_cm": 3.0}))
    assert read([str(path)]) == [dataclasses.replace(ROBOTS[0], origin="genotype.json")]


def test_what_holds_no_robots_is_named(other, tmp_path):
    with RunReader(other) as reader:
        table = elite_table(reader)
    table["solution_controller"][2] = "{}"
    write_table(table, tmp_path / "broken.csv")
    (tmp_path / "list.json").write_text("[1]")
    (tmp_path / "half.json").write_text('{"morphology": {"stiffness_level": 3, "faces": [1, 2]}}')
    (tmp_path / "bad.json").write_text('{"morphology": {}, "controller": {}}')
    (tmp_path / "text.json").write_text("text")
    evolve(tmp_path / "young.tsmr", until=3)
    for source, said in (
        ("broken.csv", "broken.csv, row 3, column solution_controller"),
        ("list.json", "list.json is no genotype"),
        ("half.json", "half.json is no genotype: it has no 'controller'"),
        ("bad.json", "bad.json: a morphology needs the keys"),
        ("text.json", "text.json is no genotype"),
        ("gone.json", "gone.json cannot be read"),
        ("gone.tsmr", "gone.tsmr does not exist"),
        ("young.tsmr", "has no finished generation"),
        ("other.tsmr:99,99", "lies outside the morphology map"),
        ("other.tsmr:", "cell"),
        ("other.tsmr:x", "cell"),
        ("other.tsmr#", "robots are named by their numbers, such as #63,7, not #"),
        ("other.tsmr#3,x", "not #3,x"),
        ("other.tsmr#999", "has no evaluation 999"),
        ("other.txt", r"robots to start from are in a run file"),
        ("other", r"robots to start from are in a run file"),
    ):
        with pytest.raises((InvalidData, RunFileError), match=said) as e:
            read([str(tmp_path / source)])
        assert "\n" not in str(e.value)
