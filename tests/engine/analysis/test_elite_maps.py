import dataclasses
import shutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import engine.runs.evolve
from engine.analysis.comparison.run_result import load_result
from engine.analysis.elite_maps import (
    EliteMap,
    archive_maps,
    double_elites,
    final_descriptor,
    lift,
    load_maps,
)
from engine.analysis.projection_run import DOWN, UP, project_run
from engine.body.morphology import Morphology
from engine.config import create_algorithm
from engine.errors import InvalidData, RunFileError
from engine.runs.evolve import resume
from engine.search.axes import (
    Axis,
    body_axes,
    body_cell,
    body_measure,
    cell_centre,
    cell_index,
    trajectory_axes,
)
from engine.search.descriptors import sensory_data
from engine.storage.reader import RunReader
from engine.storage.rows import statistics
from engine.storage.writer import RunWriter
from tests.support.made_up import MADE_UP, evaluation, examples, made_up_evaluation
from tests.support.made_up_grid import AXES, random_grid_run, write_grid_run
from tests.support.run_formats import change

MODULES, STIFFNESS, PCA_1, PCA_2 = AXES


@pytest.fixture(scope="module")
def double_run(tmp_path_factory):
    """A finished run of DM-ME with made-up figures; not to be changed."""
    path = tmp_path_factory.mktemp("double") / "double.tsmr"
    algorithm = create_algorithm(MADE_UP)
    with RunWriter.create(path, MADE_UP, engine.simulation.provenance.versions()) as writer:
        while solutions := algorithm.ask():
            evaluations = [made_up_evaluation(s, failing=0.1) for s in solutions]
            writer.add_evaluations(algorithm.generation, evaluations)
            algorithm.tell(evaluations)
            writer.close_generation(algorithm, statistics(algorithm, 0.45), 1.0)
    return path


@pytest.fixture
def grid_run(tmp_path):
    return random_grid_run(tmp_path / "grid.tsmr")


# ---- axes


def test_axes_are_told_apart():
    assert body_axes(AXES) == (0, 1)
    assert trajectory_axes(AXES) == (2, 3)


def test_bodies_are_measured():
    body = Morphology(3, (1, 2, 3, 4))
    assert body_measure(MODULES, body) == 4.0
    assert body_measure(STIFFNESS, body) == pytest.approx(0.3)
    assert body_cell((MODULES, STIFFNESS), body) == (2, 2)
    softest, stiffest = Axis("softest", 0.05, 1.05, 10), Axis("stiffest", 0.05, 1.05, 10)
    assert body_cell((softest, stiffest), body) == (2, 2)
    with pytest.raises(InvalidData, match="'colour' is unknown"):
        body_measure(Axis("colour", 0, 1, 2), body)
    with pytest.raises(InvalidData, match="outside"):
        body_cell((Axis("modules", 4.5, 10.5, 6),), body)


@given(st.integers(0, 9), st.floats(-50, 50), st.floats(0.1, 50))
@examples(30)
def test_the_centre_of_a_cell_lies_in_it(i, lower, width):
    axis = Axis("PCA 1", lower, lower + width, 10)
    assert cell_index(axis, cell_centre(axis, i)) == i


# ---- downwards


def test_projection_by_hand():
    placed = {
        (0, 1, 2, 3): (0.30, 7),
        (0, 1, 4, 3): (0.20, 9),  # the best of its body
        (0, 2, 2, 3): (0.30, 5),  # as good as number 7, and older
        (1, 1, 2, 4): (0.50, 1),
    }
    grid = EliteMap(AXES, placed)
    assert grid.project((0, 1)).elites == {(0, 1): (0.20, 9), (0, 2): (0.30, 5), (1, 1): (0.50, 1)}
    controller = grid.project((2, 3))
    assert controller.elites == {(2, 3): (0.30, 5), (4, 3): (0.20, 9), (2, 4): (0.50, 1)}
    assert controller.axes == (PCA_1, PCA_2)
    assert controller.projected
    assert controller.coverage == 3 / 90
    assert controller.qd_score(0.45) == pytest.approx(0.15 + 0.25 - 0.05)
    assert grid.best(0.45) == pytest.approx(0.25)
    assert EliteMap(AXES, {}).best(0.45) is None


def test_maps_of_a_grid_run(grid_run):
    with RunReader(grid_run) as reader:
        maps = load_maps(reader, reader.generations()[-1])
    assert set(maps) == {"grid", "morphology", "controller"}
    assert not maps["grid"].projected
    assert [a.name for a in maps["controller"].axes] == ["PCA 1", "PCA 2"]
    assert maps["morphology"].best(0.45) == maps["grid"].best(0.45)


def test_figures_over_generations_are_those_of_the_projection_then(grid_run):
    with RunReader(grid_run) as reader:
        expected = [load_maps(reader, g)["morphology"] for g in reader.generations()]
        n = [g.n_evaluations for g in reader.generations()]
    points = load_result(grid_run).points
    assert [p.n_evaluations for p in points] == n == [20, 26, 32]
    assert [p.qd_score for p in points] == pytest.approx([m.qd_score(0.45) for m in expected])
    assert [p.best for p in points] == [m.best(0.45) for m in expected]
    assert [p.coverage for p in points] == [m.coverage for m in expected]


def test_project_down(grid_run, tmp_path):
    out = tmp_path / "down.tsmr"
    report = project_run(grid_run, out)
    assert report.kind == DOWN
    with RunReader(out) as new, RunReader(grid_run) as old:
        assert new.projection == {"kind": DOWN, "source": "grid.tsmr", "created_at": old.created_at}
        assert old.projection is None
        assert [e.solution for e in new.all_evaluations()] == [e.solution for e in old.all_evaluations()]
        assert [g.n_evaluations for g in new.generations()] == [20, 26, 32]
        for then, now in zip(old.generations(), new.generations(), strict=True):
            maps = load_maps(old, then)
            for name in ("morphology", "controller"):
                assert archive_maps(new, now)[name].elites == maps[name].elites
                assert now.archives[name].qd_score == pytest.approx(maps[name].qd_score(0.45))
        assert report.filled == {n: len(maps[n].elites) for n in ("morphology", "controller")}
        assert report.n_elites == {"grid": len(maps["grid"].elites)}


def test_a_cell_that_became_empty_leaves_the_projection(tmp_path):
    def move(archive):
        archive.reinsert([((5, 5, 1, 1), archive.get((5, 5, 0, 0)))])

    path = write_grid_run(tmp_path / "moved.tsmr", [[((5, 5, 0, 0), evaluation(0))], move])
    project_run(path, tmp_path / "down.tsmr")
    with RunReader(tmp_path / "down.tsmr") as reader:
        assert reader.placements("controller", 0) == {(0, 0): 0}
        assert reader.placements("controller", 1) == {(1, 1): 0}
        assert reader.placements("morphology", 1) == {(5, 5): 0}


def test_a_projection_is_not_resumed(grid_run, tmp_path):
    project_run(grid_run, tmp_path / "down.tsmr")
    with pytest.raises(RunFileError, match=r"projection of grid.tsmr; resume that one"):
        resume(tmp_path / "down.tsmr")


# ---- upwards


def test_project_up_places_every_elite_by_the_final_pca(double_run, tmp_path):
    report = project_run(double_run, tmp_path / "up.tsmr")
    with RunReader(double_run) as old, RunReader(tmp_path / "up.tsmr") as new:
        last = old.generations()[-1]
        elites = double_elites(old, last)
        descriptor = final_descriptor(old, last.archives["controller"].axes)
        expected = {}
        n_clipped = 0
        for e in elites.values():
            (d,) = descriptor.transform(sensory_data([e.trajectory], "positions"))
            body = e.solution.morphology
            index = np.floor((d - descriptor.lower) / descriptor.width)
            n_clipped += bool((index < 0).any() or (index >= [9, 10]).any())
            i, j = np.clip(index, 0, [8, 9])
            cell = (body.n_modules - 2, body.stiffness_level - 1, int(i), int(j))
            rank = (e.fitness, e.solution.number)
            expected[cell] = min(expected.get(cell, rank), rank)
        (generation,) = new.generations()
        assert archive_maps(new, generation)["grid"].elites == dict(sorted(expected.items()))
        assert [a.name for a in generation.archives["grid"].axes] == [
            "modules",
            "stiffness",
            "PCA 1",
            "PCA 2",
        ]
        assert generation.number == last.number
        assert new.n_evaluations() == old.n_evaluations()
    assert report.kind == UP
    assert report.n_clipped == n_clipped
    assert report.n_resimulated == 0
    assert report.n_elites["morphology"] + report.n_elites["controller"] >= len(elites)


def test_up_and_down_again_keeps_the_morphology_map(double_run, tmp_path):
    project_run(double_run, tmp_path / "up.tsmr")
    project_run(tmp_path / "up.tsmr", tmp_path / "down.tsmr")
    with RunReader(double_run) as first, RunReader(tmp_path / "down.tsmr") as last:
        n = first.last_generation()
        assert last.placements("morphology", n) == first.placements("morphology", n)
        assert len(last.placements("controller", n)) >= len(first.placements("controller", n))


def test_what_lacks_a_trajectory_is_simulated_again(simulated_run, tmp_path):
    """Real simulations: without trajectories the same map comes out as with them."""
    whole, stripped = tmp_path / "whole.tsmr", tmp_path / "stripped.tsmr"
    shutil.copy(simulated_run, stripped)
    change(stripped, "UPDATE details SET trajectory = x'' WHERE number % 2 = 0")
    counts = []
    project_run(simulated_run, whole)
    report = project_run(
        stripped, tmp_path / "again.tsmr", n_threads=2, observer=lambda n, total: counts.append((n, total))
    )
    assert report.n_resimulated > 0
    assert report.n_differing == 0
    assert counts[-1] == (report.n_resimulated, report.n_resimulated)
    with RunReader(whole) as a, RunReader(tmp_path / "again.tsmr") as b:
        n = a.last_generation()
        assert a.placements("grid", n) == b.placements("grid", n)
        number = next(k for k in a.placements("grid", n).values() if k % 2 == 0)
        assert np.array_equal(a.evaluation(number).trajectory, b.evaluation(number).trajectory)
    with pytest.raises(RunFileError, match="without a trajectory and cannot be resumed"):
        resume(stripped)
    assert "simulates it again" in load_result(stripped).no_grid


def test_robots_that_another_machine_would_simulate_otherwise_are_counted(simulated_run, tmp_path):
    path = shutil.copy(simulated_run, tmp_path / "other.tsmr")
    change(
        path,
        "UPDATE evaluations SET fitness = fitness + 1e-9 WHERE fitness IS NOT NULL",
        "UPDATE details SET trajectory = x''",
    )
    report = project_run(path, tmp_path / "up.tsmr")
    assert report.n_differing == report.n_resimulated > 0


def test_lift_refuses_elites_without_trajectories(double_run):
    with RunReader(double_run) as reader:
        last = reader.generations()[-1]
        elites = double_elites(reader, last)
        first = min(elites)
        elites[first] = dataclasses.replace(elites[first], trajectory=np.zeros((4, 0, 2), np.float32))
        with pytest.raises(InvalidData, match=f"robot {first} has no trajectory"):
            lift(reader, last, elites)


# ---- bad input

STATE = "UPDATE state SET algorithm = packed(json_set(unpacked(algorithm), {}))"


def test_what_cannot_be_projected_is_refused_in_a_line(double_run, tmp_path):
    bodies_only = shutil.copy(double_run, tmp_path / "bodies.tsmr")
    archives = "packed(json_remove(unpacked(archives), '$.controller'))"
    change(
        bodies_only,
        "DELETE FROM placements WHERE archive = 'controller'",
        f"UPDATE generations SET archives = {archives}",
    )
    out = tmp_path / "out.tsmr"
    with pytest.raises(RunFileError, match="has no archive of trajectories"):
        project_run(bodies_only, out)
    no_pca = shutil.copy(double_run, tmp_path / "no-pca.tsmr")
    change(no_pca, STATE.format("'$.descriptor', NULL"))
    with pytest.raises(RunFileError, match="holds no PCA"):
        project_run(no_pca, out)
    with RunWriter.create(tmp_path / "new.tsmr", MADE_UP, {}):
        pass
    with pytest.raises(RunFileError, match="no finished generation"):
        project_run(tmp_path / "new.tsmr", out)
    with pytest.raises(RunFileError, match="exists"):
        project_run(double_run, no_pca)
    with pytest.raises(RunFileError, match=r"ends in \.tsmr"):
        project_run(double_run, tmp_path / "out.txt")
    assert not out.exists()


@pytest.mark.parametrize(
    ("sql", "reason"),
    [
        (
            STATE.format("'$.descriptor.mean', json('[1]')"),
            "mean",
        ),
        (
            STATE.format("'$.descriptor.width[0]', 0"),
            "not positive",
        ),
        (STATE.format("'$.descriptor', 3"), "damaged"),
        ("UPDATE state SET algorithm = packed('[]')", "damaged"),
        ("UPDATE evaluations SET fitness = NULL", "holds a cell"),
    ],
)
def test_a_damaged_double_run_is_refused_in_a_line(double_run, tmp_path, sql, reason):
    path = shutil.copy(double_run, tmp_path / "damaged.tsmr")
    change(path, sql)
    with pytest.raises(RunFileError, match=reason) as e:
        project_run(path, tmp_path / "out.tsmr")
    assert "\n" not in str(e.value)
    assert not (tmp_path / "out.tsmr").exists()


@pytest.mark.parametrize(
    "sql",
    [
        "UPDATE OR REPLACE placements SET cell = '1,2'",
        "UPDATE OR REPLACE placements SET cell = '99,1,1,1'",
        "UPDATE evaluations SET fitness = NULL",
    ],
)
def test_a_damaged_grid_run_is_refused_in_a_line(grid_run, tmp_path, sql):
    change(grid_run, sql)
    for use in (lambda: project_run(grid_run, tmp_path / "out.tsmr"), lambda: load_result(grid_run)):
        with pytest.raises(RunFileError) as e:
            use()
        assert "\n" not in str(e.value)
    assert not (tmp_path / "out.tsmr").exists()


def test_cells_that_no_body_can_lie_in_do_not_count():
    axes = (MODULES, Axis("softest", 0.05, 1.05, 10), Axis("stiffest", 0.05, 1.05, 10))
    assert EliteMap(axes, {}).n_cells == 9 * 55
    assert EliteMap((*axes, PCA_1, PCA_2), {}).n_cells == 9 * 55 * 90
    assert EliteMap(axes[:2], {}).n_cells == 90
