import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from engine.analysis.elite_maps import load_maps
from engine.analysis.profile import (
    Profile,
    ProfileHistory,
    aperture,
    count_above,
    counts_above,
    map_over_time,
    offset_qd_score,
    still_limit,
    threshold,
    unsteered_limit,
)
from engine.search.axes import body_axes
from engine.storage.reader import RunReader
from engine.tasks import Task, get_task
from engine.tasks.task import fitness, target_offsets
from tests.support.made_up import evaluation, examples
from tests.support.made_up_grid import random_grid_run, write_grid_run

GOALS, SQUEEZING = get_task("goal-reaching"), get_task("squeezing")


def a_task(*bearings):
    return Task(name="a", inputs=("x",), sense=lambda v: v, target_distance=0.5, target_bearings=bearings)


def test_what_no_robot_reaches_that_does_not_steer():
    # it ends 9 cm ahead: from there to 45 degrees 39.15 cm and to 90 degrees 45.89 cm; so 45 cm less the mean
    # of their mean and their maximum
    assert 100 * unsteered_limit(GOALS) == pytest.approx(45 - (42.52 + 45.89) / 2, abs=0.01)
    assert threshold(GOALS) == unsteered_limit(GOALS)
    # all the way to a single target
    assert unsteered_limit(a_task(0.3)) == pytest.approx(0.5, abs=1e-6)
    # nowhere, with targets ahead and behind
    assert unsteered_limit(a_task(0.0, np.pi)) == pytest.approx(0.0, abs=1e-6)


@given(st.lists(st.floats(-3.1, 3.1), min_size=1, max_size=5))
@examples(15)
def test_no_place_is_better_for_all_targets(bearings):
    task = a_task(*bearings)

    def worse(p):
        return fitness(np.linalg.norm(target_offsets(task) - p, axis=1)[:, None])

    found = min(minimize(worse, p, method="Nelder-Mead").fun for p in ([0.01, 0.02], *target_offsets(task)))
    assert unsteered_limit(task) >= 0.5 - found - 1e-6
    assert unsteered_limit(task) <= 0.5 - found + 1e-3


def test_the_aperture_is_where_the_paper_draws_its_line():
    assert 100 * aperture(SQUEEZING) == pytest.approx(15.17, abs=0.005)
    assert aperture(GOALS) is None
    # a robot gets there without steering
    assert threshold(SQUEEZING) == aperture(SQUEEZING) < unsteered_limit(SQUEEZING)
    assert threshold(a_task(0.1, -0.1)) == 0.25


def test_a_robot_lies_still_below_what_chance_gets_in_every_task():
    assert 100 * still_limit(GOALS) == pytest.approx(0.79, abs=0.01)
    assert still_limit(SQUEEZING) == still_limit(GOALS) < threshold(SQUEEZING)


def test_counts_by_hand():
    values = [0.1, -0.2, 0.1, 0.3]
    assert count_above(values, 0.1) == 1
    assert counts_above(values, np.array([-1.0, 0.0, 0.1, 0.2, 0.3])).tolist() == [4, 3, 1, 1, 0]
    assert counts_above([], np.array([0.0])).tolist() == [0]


def test_the_offset_score_by_hand():
    assert offset_qd_score([0.1, -0.1], 0.45) == pytest.approx(0.9)
    assert offset_qd_score([-0.6], 0.45) == 0.0


@given(st.lists(st.floats(-2, 1), max_size=6), st.floats(-2, 1))
@examples(30)
def test_filling_a_cell_never_lowers_the_offset_score(values, one_more):
    assert offset_qd_score([*values, one_more], 0.45) >= offset_qd_score(values, 0.45)


def test_the_map_over_time_is_what_the_file_holds_at_its_end(tmp_path):
    path = random_grid_run(tmp_path / "a.tsmr", 3)
    with RunReader(path) as reader:
        generations = reader.generations()
        keep = body_axes(generations[-1].archives["grid"].axes)
        grid = [dict(m) for m in map_over_time(reader, "grid", generations)]
        bodies = [dict(m) for m in map_over_time(reader, "grid", generations, keep=keep)]
        maps = [load_maps(reader, g) for g in generations]
    for k, shown in enumerate(maps):
        assert grid[k] == {c: f for c, (f, _) in shown["grid"].elites.items()}
        assert bodies[k] == {c: f for c, (f, _) in shown["morphology"].elites.items()}
    assert len(grid) == 3


def test_a_cell_that_is_emptied_does_not_count(tmp_path):
    e = evaluation(0, 0.4)
    path = write_grid_run(tmp_path / "a.tsmr", [[((0, 0, 0, 0), e)], lambda archive: archive.reinsert([])])
    with RunReader(path) as reader:
        assert [dict(m) for m in map_over_time(reader, "grid", reader.generations())] == [
            {(0, 0, 0, 0): 0.4},
            {},
        ]


def test_the_history_of_a_live_run_grows_to_that_of_the_whole(tmp_path):
    path = random_grid_run(tmp_path / "a.tsmr", 4, sizes=(8, 6, 6, 6))
    whole, grown = ProfileHistory(GOALS), ProfileHistory(GOALS)
    with RunReader(path) as reader:
        generations = reader.generations()
        whole.extend(reader, generations)
        for part in (generations[:1], generations[1:3], generations[3:]):
            grown.extend(reader, part)
        for g in generations:
            values = [0.45 - f for f, _ in load_maps(reader, g)["grid"].elites.values()]
            assert grown.get(g.number, "grid") == whole.get(g.number, "grid") == Profile.of(values, GOALS)
            assert whole.get(g.number, "grid").above == count_above(values, unsteered_limit(GOALS)) > 0
    assert whole.get(99, "grid") is whole.get(0, "morphology") is None
