import json

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from sklearn.decomposition import PCA
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from engine.search.descriptors import (
    CONTROLLER_SHAPE,
    TrajectoryDescriptor,
    sensory_data,
)
from tests.support.made_up import examples

axes = st.integers(2, 12)
# multiples of 1/64, so that neighbouring values are far further apart than rounding errors
points = hnp.arrays(
    float,
    st.tuples(st.integers(1, 30), st.just(2)),
    elements=st.integers(-6400, 6400).map(lambda i: i / 64),
)


@st.composite
def sensory(draw):
    """Sensory data of various sizes, some features constant, of very different scales."""
    n, f = draw(st.integers(4, 40)), draw(st.integers(4, 60))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    data = rng.normal(size=(n, f)) * np.exp(rng.normal(size=f)) + rng.normal(size=f)
    data[:, : draw(st.integers(0, f - 3))] = 0.25
    return data


def test_the_shape_of_the_archive():
    assert CONTROLLER_SHAPE == (9, 10)


def test_sensory_data_lists_targets_then_seconds_then_xy():
    path = np.arange(12, dtype=np.float32).reshape(2, 3, 2)
    data = sensory_data([path, path + 100], "positions")
    assert data.tolist() == [list(range(12)), list(range(100, 112))]
    assert data.dtype == float


def test_displacements_start_from_the_origin_on_every_target():
    path = np.array([[[1.0, 2.0], [4.0, 2.0]], [[0.5, 0.0], [0.0, -1.0]]])
    assert sensory_data([path], "displacements").tolist() == [[1.0, 2.0, 3.0, 0.0, 0.5, 0.0, -0.5, -1.0]]


def test_goal_reaching_has_320_numbers():
    assert sensory_data([np.zeros((4, 40, 2), np.float32)] * 3, "positions").shape == (3, 320)


def test_bounds_of_a_hand_case():
    d = TrajectoryDescriptor(shape=(3, 5))
    d.set_bounds(np.array([[0.0, -1.0], [10.0, 1.0], [4.0, 0.0]]))
    # two steps of 5 between three centres; four steps of 0.5 between five
    np.testing.assert_allclose(d.width, [5.0, 0.5])
    np.testing.assert_allclose(d.lower, [-2.5, -1.25])
    np.testing.assert_allclose(d.upper, [12.5, 1.25])
    assert d.cell(np.array([0.0, -1.0])) == (0, 0)
    assert d.cell(np.array([10.0, 1.0])) == (2, 4)
    assert d.cell(np.array([2.4, 0.2])) == (0, 2)
    assert d.cell(np.array([2.6, 0.3])) == (1, 3)


@examples(150)
@given(points, axes, axes)
def test_extreme_values_sit_at_the_centres_of_the_first_and_the_last_cell(values, nx, ny):
    d = TrajectoryDescriptor(shape=(nx, ny))
    d.set_bounds(values)
    for axis, n in enumerate((nx, ny)):
        low, high = values[:, axis].min(), values[:, axis].max()
        assert (low - d.lower[axis]) / d.width[axis] == pytest.approx(0.5)
        if high > low:
            assert (high - d.lower[axis]) / d.width[axis] == pytest.approx(n - 0.5)
            assert d.cell(values[values[:, axis].argmin()])[axis] == 0
            assert d.cell(values[values[:, axis].argmax()])[axis] == n - 1


@examples(150)
@given(points, axes, axes)
def test_everything_that_set_the_bounds_is_inside_them(values, nx, ny):
    d = TrajectoryDescriptor(shape=(nx, ny))
    d.set_bounds(values)
    assert not d.out_of_bounds(values)
    for v in values:
        cell = d.cell(v)
        centre = d.lower + d.width * (np.array(cell) + 0.5)
        assert (np.abs(v - centre) <= d.width / 2 * (1 + 1e-9)).all()


@examples(100)
@given(points, st.integers(0, 1), st.booleans())
def test_half_a_cell_beyond_an_extreme_value_is_the_bound(values, axis, above):
    d = TrajectoryDescriptor(shape=(9, 10))
    d.set_bounds(values)
    inside = values[values[:, axis].argmax() if above else values[:, axis].argmin()].copy()
    outside = inside.copy()
    # an axis of equal values has them at the first cell's centre
    room = d.upper[axis] - inside[axis] if above else inside[axis] - d.lower[axis]
    sign = 1 if above else -1
    inside[axis] += 0.99 * sign * room
    outside[axis] += 1.01 * sign * room
    assert not d.out_of_bounds(np.array([inside]))
    assert d.out_of_bounds(np.array([outside]))
    assert d.out_of_bounds(np.vstack([values, outside]))


def test_an_axis_of_one_cell_takes_everything():
    d = TrajectoryDescriptor(shape=(1, 4))
    values = np.array([[-3.0, 0.0], [5.0, 1.0], [1.0, 0.5]])
    d.set_bounds(values)
    assert not d.out_of_bounds(values)
    assert {d.cell(v)[0] for v in values} == {0}


@examples(60)
@given(sensory())
def test_descriptors_are_those_of_scikit_learn(data):
    d = TrajectoryDescriptor()
    assert not d.fitted
    d.fit(data)
    assert d.fitted
    published = make_pipeline(StandardScaler(), PCA(n_components=2, svd_solver="full")).fit(data)
    other = data[::-1] * 1.5 + 0.1
    for x in (data, other):
        # fits are rounded to ten digits
        np.testing.assert_allclose(d.transform(x), published.transform(x), rtol=1e-8, atol=1e-8)


def test_last_digits_in_which_computers_differ_do_not_change_a_fit():
    rng = np.random.default_rng(3)
    data = rng.normal(size=(120, 320)) * np.exp(rng.normal(size=320)) + rng.normal(size=320)
    d, other = TrajectoryDescriptor(), TrajectoryDescriptor()
    d.fit(data)
    # a row order is as good as a processor: sums end in other digits
    other.fit(data[::-1].copy())
    scalers = [StandardScaler().fit(x) for x in (data, data[::-1].copy())]
    assert scalers[0].mean_.tolist() != scalers[1].mean_.tolist()
    assert d.state() == other.state()


@examples(60)
@given(sensory())
def test_the_first_component_varies_most_and_both_are_uncorrelated(data):
    d = TrajectoryDescriptor()
    d.fit(data)
    covariance = np.cov(d.transform(data), rowvar=False)
    assert covariance[0, 0] >= covariance[1, 1] * (1 - 1e-9)
    assert abs(covariance[0, 1]) < 1e-9 * covariance[0, 0]


def test_descriptors_of_a_hand_case():
    # two independent features: standardised they lie on the corners of a rectangle
    data = np.array([[0.0, 10.0], [2.0, 10.0], [0.0, 10.5], [2.0, 10.5], [0.0, 10.0], [2.0, 10.5]])
    d = TrajectoryDescriptor()
    d.fit(data)
    # features correlate by 1/3, so the components are (1, 1) / sqrt 2 and (1, -1) / sqrt 2
    got = d.transform(data)
    standard = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1], [-1, -1], [1, 1]])
    np.testing.assert_allclose(np.abs(got[:, 0]), np.abs(standard.sum(axis=1)) / 2**0.5, atol=1e-9)
    np.testing.assert_allclose(np.abs(got[:, 1]), np.abs(standard[:, 0] - standard[:, 1]) / 2**0.5, atol=1e-9)


@examples(30)
@given(sensory())
def test_fitting_sets_the_bounds_to_the_same_data(data):
    d = TrajectoryDescriptor()
    d.fit(data)
    by_hand = TrajectoryDescriptor()
    by_hand.set_bounds(d.transform(data))
    assert d.lower.tolist() == by_hand.lower.tolist()
    assert d.width.tolist() == by_hand.width.tolist()
    assert not d.out_of_bounds(d.transform(data))


@examples(40)
@given(sensory(), st.integers(0, 100))
def test_a_descriptor_is_the_same_bits_in_any_company(data, i):
    d = TrajectoryDescriptor()
    d.fit(data)
    i %= len(data)
    assert d.transform(data)[i].tolist() == d.transform(data[i : i + 1])[0].tolist()


@pytest.mark.parametrize("n", [2, 3])
def test_a_fit_to_hardly_any_data(n):
    data = np.random.default_rng(n).normal(size=(n, 8))
    d = TrajectoryDescriptor()
    d.fit(data)
    described = d.transform(data)
    assert np.isfinite(described).all()
    assert len({d.cell(x) for x in described}) == n


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")  # scikit-learn: no variance
def test_a_fit_to_equal_data():
    d = TrajectoryDescriptor()
    d.fit(np.full((5, 8), 0.3))
    described = d.transform(np.full((5, 8), 0.3))
    assert np.isfinite(described).all()
    assert not d.out_of_bounds(described)
    assert len({d.cell(x) for x in described}) == 1


@examples(30)
@given(sensory())
def test_state_survives_json_to_the_last_bit(data):
    assume(len(data) > 4)
    d, copy = TrajectoryDescriptor(), TrajectoryDescriptor()
    d.fit(data[:-2])
    d.set_bounds(d.transform(data))
    copy.restore(json.loads(json.dumps(d.state())))
    assert copy.fitted
    assert copy.transform(data).tolist() == d.transform(data).tolist()
    assert [copy.cell(x) for x in copy.transform(data)] == [d.cell(x) for x in d.transform(data)]
    assert copy.state() == d.state()
