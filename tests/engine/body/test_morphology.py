import json
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body.morphology import Morphology, mutate_morphology, random_morphology
from engine.errors import InvalidData
from tests.support.made_up import examples, morphologies, per_module_morphologies

anyone = morphologies | per_module_morphologies()


@examples(100)
@given(anyone)
def test_json_round_trip_is_lossless(m):
    assert Morphology.from_json(json.loads(json.dumps(m.to_json()))) == m


def test_what_a_morphology_says_of_itself():
    m = Morphology(stiffness_level=3, faces=(1, 8, 4))
    assert m.n_modules == 3
    assert m.stiffness == pytest.approx(0.3)
    assert m.to_json() == {"stiffness_level": 3, "faces": [1, 8, 4]}


@pytest.mark.parametrize("level", [0, 11, -1, 5.0, "5", None, True])
def test_stiffness_out_of_range_is_refused(level):
    with pytest.raises(InvalidData, match="stiffness level"):
        Morphology(stiffness_level=level, faces=(1, 2))


@pytest.mark.parametrize("n", [0, 1, 11])
def test_number_of_modules_out_of_range_is_refused(n):
    with pytest.raises(InvalidData, match="number of modules"):
        Morphology(stiffness_level=5, faces=(1,) * n)


@pytest.mark.parametrize("n", [2, 10])
def test_the_smallest_and_the_largest_robot_are_allowed(n):
    assert Morphology(stiffness_level=1, faces=(8,) * n).n_modules == n


@pytest.mark.parametrize("face", [0, 9, 1.0, "1", None, True, [1]])
def test_a_face_out_of_range_is_refused(face):
    with pytest.raises(InvalidData, match="face"):
        Morphology(stiffness_level=5, faces=(1, face))


def test_faces_are_a_tuple():
    with pytest.raises(InvalidData, match="tuple"):
        Morphology(stiffness_level=5, faces=[1, 2])


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        "text",
        7,
        {},
        {"stiffness_level": 5},
        {"faces": [1, 2]},
        {"stiffness_level": 5, "faces": [1, 2], "more": 1},
        {"stiffness_level": 5, "faces": "12"},
        {"stiffness_level": 5, "faces": {"1": 2}},
        {"stiffness_level": 5, "faces": None},
        {"stiffness_level": 5, "faces": [1, float("nan")]},
        {"stiffness_level": float("nan"), "faces": [1, 2]},
        {"stiffness_level": 10**400, "faces": [1, 2]},
        {"stiffness_level": 5, "faces": [[1], {}]},
        {"stiffness_level": [5], "faces": [1, 2]},
        {"stiffness_level": [5, 5, 5], "faces": [1, 2]},
        {"stiffness_level": [5, 11], "faces": [1, 2]},
        {"stiffness_level": [5, 5.0], "faces": [1, 2]},
        {"stiffness_level": [5, [5]], "faces": [1, 2]},
        {"stiffness_level": {"0": 5, "1": 5}, "faces": [1, 2]},
        {"stiffness_level": [], "faces": []},
    ],
)
def test_malformed_json_is_refused(data):
    with pytest.raises(InvalidData):
        Morphology.from_json(data)


@examples(100)
@given(anyone, st.integers(0, 2**32))
def test_mutation_stays_in_range_and_leaves_the_parent_alone(parent, seed):
    before = parent.to_json()
    rng = random.Random(seed)
    child = parent
    for _ in range(10):
        # out of range raises
        child = mutate_morphology(child, rng)
        assert child.stiffness_mode == parent.stiffness_mode
    assert parent.to_json() == before
    assert mutate_morphology(parent, random.Random(seed)) == mutate_morphology(parent, random.Random(seed))


@examples(100)
@given(morphologies, st.integers(0, 2**32))
def test_one_mutation_makes_at_most_one_global_change(parent, seed):
    child = mutate_morphology(parent, random.Random(seed))
    resized = child.n_modules - parent.n_modules
    assert resized in (-1, 0, 1)
    assert not (resized and child.stiffness_level != parent.stiffness_level)


def test_frequencies_of_mutations():
    rng = random.Random(7)
    parent = Morphology(5, (3,) * 6)
    n = 20_000
    children = [mutate_morphology(parent, rng) for _ in range(n)]

    def share(condition):
        return sum(map(condition, children)) / n

    # a global mutation with 0.3, a third of it each kind; a tenth of the redraws gives 5 again.
    # The largest standard deviation below is 0.0032.
    assert share(lambda c: c.n_modules == 7) == pytest.approx(0.1, abs=0.011)
    assert share(lambda c: c.n_modules == 5) == pytest.approx(0.1, abs=0.011)
    assert share(lambda c: c.stiffness_level != 5) == pytest.approx(0.09, abs=0.011)
    # 0.3 of the faces are redrawn, an eighth of these gives the same face again
    same_size = [c for c in children if c.n_modules == 6]
    changed = sum(f != 3 for c in same_size for f in c.faces) / (6 * len(same_size))
    assert changed == pytest.approx(0.3 * 7 / 8, abs=0.007)


@pytest.mark.parametrize(("n", "forbidden"), [(2, 1), (10, 11)])
def test_mutation_at_the_limits(n, forbidden):
    rng = random.Random(3)
    sizes = {mutate_morphology(Morphology(5, (1,) * n), rng).n_modules for _ in range(500)}
    assert forbidden not in sizes
    assert len(sizes) == 2


def test_random_morphologies_are_uniform_and_reproducible():
    rng = random.Random(5)
    n = 9000
    drawn = [random_morphology(rng) for _ in range(n)]
    sizes = [m.n_modules for m in drawn]
    levels = [m.stiffness_level for m in drawn]
    faces = [f for m in drawn for f in m.faces]
    for values, kinds in ((sizes, range(2, 11)), (levels, range(1, 11)), (faces, range(1, 9))):
        p = 1 / len(kinds)
        five_sigma = 5 * (len(values) * p * (1 - p)) ** 0.5
        assert all(abs(values.count(k) - len(values) * p) < five_sigma for k in kinds)
        assert set(values) == set(kinds)
    again = random.Random(5)
    assert [random_morphology(again) for _ in range(50)] == drawn[:50]


# ---- a stiffness for each module


def test_what_a_body_of_unlike_modules_says_of_itself():
    m = Morphology((3, 10, 1), (1, 8, 4))
    assert m.to_json() == {"stiffness_level": [3, 10, 1], "faces": [1, 8, 4]}
    assert m.stiffness_levels == (3, 10, 1)
    assert m.stiffnesses == pytest.approx((0.3, 1.0, 0.1))
    assert m.stiffness == pytest.approx(1.4 / 3)
    assert m.stiffness_text == "0.3 1.0 0.1"
    assert m.stiffness_mode == "per-module"


def test_shared_stiffness_is_that_of_every_module():
    m = Morphology(3, (1, 8, 4))
    assert (m.stiffness_levels, m.stiffness_text, m.stiffness_mode) == ((3, 3, 3), "0.3", "shared")
    # equal stiffnesses that may part are another genotype
    assert m != Morphology((3, 3, 3), (1, 8, 4))


@examples(100)
@given(per_module_morphologies(), st.integers(0, 2**32))
def test_a_module_takes_its_stiffness_along(parent, seed):
    """Modules that were not drawn for a mutation stay what they were, also where one comes or goes."""
    child = mutate_morphology(parent, random.Random(seed))
    before, after = (list(zip(m.stiffness_level, m.faces, strict=True)) for m in (parent, child))
    at_places = range(max(len(before), len(after)))
    if len(after) > len(before):
        aligned = [[*after[:i], *after[i + 1 :]] for i in at_places]
        pairs = [list(zip(before, a, strict=True)) for a in aligned]
    elif len(after) < len(before):
        aligned = [[*before[:i], *before[i + 1 :]] for i in at_places]
        pairs = [list(zip(b, after, strict=True)) for b in aligned]
    else:
        pairs = [list(zip(before, after, strict=True))]
    # a local mutation changes one of the two genes only
    assert any(all(b[0] == a[0] or b[1] == a[1] for b, a in pairing) for pairing in pairs)


def test_frequencies_of_mutations_of_unlike_modules():
    rng = random.Random(11)
    parent = Morphology((5,) * 6, (3,) * 6)
    n = 20_000
    children = [mutate_morphology(parent, rng) for _ in range(n)]
    grown = [c for c in children if c.n_modules == 7]
    shrunk = [c for c in children if c.n_modules == 5]
    same_size = [c for c in children if c.n_modules == 6]
    # a tenth each; five standard deviations are 0.011
    assert len(grown) / n == pytest.approx(0.1, abs=0.011)
    assert len(shrunk) / n == pytest.approx(0.1, abs=0.011)
    modules = [pair for c in same_size for pair in zip(c.stiffness_level, c.faces, strict=True)]

    # 0.2 of either gene are redrawn, a tenth or an eighth of these gives the same value again
    levels, faces = zip(*modules, strict=True)
    assert 1 - levels.count(5) / len(levels) == pytest.approx(0.2 * 9 / 10, abs=0.006)
    assert 1 - faces.count(3) / len(faces) == pytest.approx(0.2 * 7 / 8, abs=0.006)
    assert not any(level != 5 and face != 3 for level, face in modules)
    # an inserted module has a level of its own, redrawn or not: nine tenths differ from the others
    changed = sum(level != 5 for c in grown for level in c.stiffness_level)
    assert changed / len(grown) == pytest.approx(0.9 + 6 * 0.18, abs=0.11)


@pytest.mark.parametrize(("n", "forbidden"), [(2, 1), (10, 11)])
def test_unlike_modules_at_the_limits(n, forbidden):
    rng = random.Random(3)
    parent = Morphology((5,) * n, (1,) * n)
    sizes = {mutate_morphology(parent, rng).n_modules for _ in range(500)}
    assert forbidden not in sizes
    assert len(sizes) == 2


def test_random_modules_have_independent_levels():
    rng = random.Random(5)
    drawn = [random_morphology(rng, "per-module") for _ in range(3000)]
    levels = [level for m in drawn for level in m.stiffness_level]
    p = 1 / 10
    five_sigma = 5 * (len(levels) * p * (1 - p)) ** 0.5
    assert all(abs(levels.count(k) - len(levels) * p) < five_sigma for k in range(1, 11))
    # two neighbours are equal by chance only
    equal = sum(m.stiffness_level[0] == m.stiffness_level[1] for m in drawn) / len(drawn)
    assert equal == pytest.approx(0.1, abs=0.028)
