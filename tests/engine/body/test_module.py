import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.simulation.model import module_placements

FACE_PAIRS = list(itertools.product(range(1, 9), repeat=2))


def centroid(face):
    return t.NODES[list(t.FACES[face])].mean(axis=0)


def placed_nodes(morphology):
    """World positions of every module's nodes, as built."""
    return [centre + turn.apply(t.NODES) for turn, centre in module_placements(morphology)]


@pytest.mark.parametrize("faces", FACE_PAIRS, ids=lambda f: f"{f[0]}-{f[1]}")
@pytest.mark.parametrize("first", [0, 1])
def test_joined_nodes_are_the_nearest_ones(faces, first):
    # the joint between modules 0 and 1, then the one between 1 and 2
    chain = (*[1] * first, *faces)
    nodes = placed_nodes(Morphology(5, chain))
    a = nodes[first][list(t.FACES[faces[0]])]
    b = nodes[first + 1][list(t.FACES[t.OPPOSITE_FACE[faces[1]]])]
    distance = np.linalg.norm(a[:, None] - b[None], axis=-1)
    for p, q in t.JOINT_ORDER:
        assert distance[p].argmin() == q
        assert distance[:, q].argmin() == p
        assert distance[p, q] < 0.006
    assert sorted(p for p, _ in t.JOINT_ORDER) == sorted(q for _, q in t.JOINT_ORDER) == [0, 1, 2]


def test_a_module_is_six_rods_and_twenty_four_cables():
    assert len(t.NODES) == 12
    assert len(t.RODS) == 6
    assert sorted(n for rod in t.RODS for n in rod) == list(range(12))
    assert len({frozenset(c) for c in t.CABLES}) == len(t.CABLES) == 24


def test_rods_are_equally_long_and_do_not_touch():
    for a, b in t.RODS:
        assert np.linalg.norm(t.NODES[a] - t.NODES[b]) == pytest.approx(t.ROD_LENGTH)
        assert t.rod_of(a) == t.rod_of(b) == t.RODS.index((a, b))
    middles = [t.NODES[list(rod)].mean(axis=0) for rod in t.RODS]
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(middles, 2)) > 2 * (t.ROD_RADIUS)


def test_every_node_holds_four_cables_of_one_length():
    ends = [n for cable in t.CABLES for n in cable]
    assert all(ends.count(n) == 4 for n in range(12))
    lengths = [np.linalg.norm(t.NODES[a] - t.NODES[b]) for a, b in t.CABLES]
    assert max(lengths) == pytest.approx(min(lengths))
    # no cable runs along a rod
    assert not {frozenset(c) for c in t.CABLES} & {frozenset(r) for r in t.RODS}


def test_faces_are_triangles_of_cables_and_of_three_rods():
    cables = {frozenset(c) for c in t.CABLES}
    assert sorted(t.FACES) == list(range(1, 9))
    for nodes in t.FACES.values():
        assert {frozenset(pair) for pair in itertools.combinations(nodes, 2)} <= cables
        assert len({t.rod_of(n) for n in nodes}) == 3


def test_opposite_faces_lie_opposite():
    for face, opposite in t.OPPOSITE_FACE.items():
        assert t.OPPOSITE_FACE[opposite] == face != opposite
        np.testing.assert_allclose(centroid(face), -centroid(opposite), atol=1e-12)


@pytest.mark.parametrize("face", range(1, 9))
def test_a_turned_face_points_along_the_chain(face):
    turned = Rotation.from_quat(t.FACE_TURN[face], scalar_first=True).apply(centroid(face))
    np.testing.assert_allclose(turned / np.linalg.norm(turned), t.CHAIN_AXIS, atol=1e-9)


def test_turns_are_those_of_the_published_chain():
    def quarter(axis, n):
        """A turn by n x 90 degrees about a coordinate axis."""
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][n % 4]
        i, j = {"x": (1, 2), "y": (2, 0)}[axis]
        m = np.eye(3)
        m[i, i], m[i, j], m[j, i], m[j, j] = c, -s, s, c
        return m

    expected = {
        1: np.eye(3),
        2: quarter("y", 1),
        3: quarter("y", 2),
        4: quarter("y", -1),
        5: quarter("y", 1) @ quarter("x", 2),
        6: quarter("x", 2),
        7: quarter("y", -1) @ quarter("x", 2),
        8: quarter("y", 2) @ quarter("x", 2),
    }
    for face, matrix in expected.items():
        np.testing.assert_allclose(
            Rotation.from_quat(t.FACE_TURN[face], scalar_first=True).as_matrix(), matrix, atol=1e-9
        )


def test_built_size():
    assert np.ptp(t.NODES, axis=0) == pytest.approx([0.082] * 3)
    assert 2 * np.linalg.norm(t.NODES, axis=1).max() == pytest.approx(t.NOMINAL_LENGTH, abs=1e-4)
    # one module every 3.75 sqrt 2 cm along each of three axes
    assert pytest.approx(np.linalg.norm([0.0375 * 2**0.5] * 3)) == t.MODULE_SPACING


def test_passive_cables_end_on_the_rods_surfaces():
    for a, b in t.CABLES:
        ends = []
        for node, other in ((a, b), (b, a)):
            anchor = t.passive_anchor(node, other)
            p, q = (t.NODES[n] for n in t.RODS[t.rod_of(node)])
            axis = (q - p) / np.linalg.norm(q - p)
            offset = anchor - t.NODES[node]
            assert np.linalg.norm(offset) == pytest.approx(t.ROD_RADIUS)
            assert offset @ axis == pytest.approx(0.0, abs=1e-12)
            ends.append(anchor)
        between_nodes = np.linalg.norm(t.NODES[a] - t.NODES[b])
        # published: 0.25 cm shorter than between the nodes
        assert between_nodes - np.linalg.norm(ends[0] - ends[1]) == pytest.approx(0.0025, abs=2e-4)


def test_internal_cables_run_from_the_servo_to_their_nodes():
    np.testing.assert_allclose(t.ACTUATOR_POINT, [-0.0375 + 0.0179, 0.0, 0.0])
    for node in t.SERVO_NODES:
        on_sphere, on_rod = t.servo_anchors(node)
        full = np.linalg.norm(t.NODES[node] - t.ACTUATOR_POINT)
        assert np.linalg.norm(on_sphere - t.ACTUATOR_POINT) == pytest.approx(t.ACTUATOR_RADIUS)
        assert np.linalg.norm(on_rod - t.NODES[node]) == pytest.approx(t.ROD_RADIUS)
        # published: 0.48 to 0.53 cm shorter than from the actuator point to the node
        assert 0.0045 < full - np.linalg.norm(on_sphere - on_rod) < 0.0055


def test_the_servo_pulls_nodes_of_the_actuated_faces_only():
    assert len(set(t.SERVO_NODES)) == 5
    assert set(t.SERVO_NODES) <= {*t.FACES[1], *t.FACES[5]}


def test_stiffness_in_newton_per_metre():
    assert t.stiffness_n_per_m(1.0) == pytest.approx(115.2)
    assert t.stiffness_n_per_m(0.3) == pytest.approx(34.56)
