"""Cameras, and pictures of robots."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine.body import module as t
from engine.simulation.model import module_placements
from viz.build_sheet.facts import links
from viz.build_sheet.scene import OrthographicCamera, SceneView, clearest
from viz.build_sheet.sections.assembly import MODULE
from viz.build_sheet.sections.net import neighbours
from viz.build_sheet.style import signed
from viz.robot.skeleton import Skeleton

angles = st.floats(-180, 180)


@settings(max_examples=25, deadline=None)
@given(angles, st.floats(-89, 89))
def test_a_camera_keeps_lengths_and_looks_along_its_axis(azimuth, elevation):
    camera = OrthographicCamera.looking(azimuth, elevation)
    axes = np.stack([camera.right, camera.up, np.cross(camera.right, camera.up)])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_the_top_is_up_and_what_is_nearer_hides_what_is_behind():
    camera = OrthographicCamera.looking(0, 30)
    assert camera.up[2] > 0
    assert camera.depth(np.array([0.0, -1.0, 0.0])) > camera.depth(np.array([0.0, 1.0, 0.0]))
    assert camera.depth(np.array([0.0, 0.0, 1.0])) > camera.depth(np.zeros(3))


@settings(max_examples=25, deadline=None)
@given(st.floats(-60, 60), st.floats(0, 60))
def test_a_fitting_view_shows_everything_inside_the_box(azimuth, elevation):
    box = (10.0, 20.0, 200.0, 100.0)
    view = SceneView.fitting(OrthographicCamera.looking(azimuth, elevation), t.NODES, box)
    places = np.array([view.at(n) for n in t.NODES])
    assert (places >= np.array([10.0, 20.0]) - 1e-6).all()
    assert (places <= np.array([210.0, 120.0]) + 1e-6).all()


def test_the_clearest_camera_tells_all_nodes_apart():
    camera = clearest(t.NODES, range(-44, 46, 4), range(12, 40, 3))
    seen = camera.flat(t.NODES)
    apart = np.linalg.norm(seen[:, None] - seen[None], axis=-1)[np.triu_indices(12, 1)]
    assert apart.min() > 0.01


def test_as_built_the_joined_nodes_are_a_links_length_apart(robots):
    for facts in robots.values():
        built = links(Skeleton.placed(module_placements(facts.morphology)), facts.joints)
        lengths = np.linalg.norm(built[:, 1] - built[:, 0], axis=1)
        assert len(lengths) == 3 * (facts.morphology.n_modules - 1)
        assert lengths.max() < 0.0055
        settled = links(facts.body, facts.joints)
        lengths = np.linalg.norm(settled[:, 1] - settled[:, 0], axis=1)
        assert 0.0 < lengths.min() <= lengths.max() < 0.0055


def test_a_settled_robot_has_rods_of_the_right_length_and_stands_on_the_ground(robots):
    for facts in robots.values():
        ends = facts.body.nodes[:, list(t.RODS)]
        lengths = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1)
        np.testing.assert_allclose(lengths, t.ROD_LENGTH, atol=1e-5)
        assert facts.extent()[0][2] == pytest.approx(-t.ROD_RADIUS, abs=0.02)
        length, width, height = facts.size
        assert length > width > 0.05
        assert 0.05 < height < 0.12


def test_every_node_has_four_neighbours():
    assert MODULE.nodes.shape == (1, 12, 3)
    header, *rows = ([cell.text for cell in row] for row in neighbours(500)._cellvalues)
    assert header == ["node", "rod to", "cables to", "internal cable"] * 2
    told = {int(row[k]): row[k + 1 : k + 4] for k in (0, 4) for row in rows}
    assert set(told) == set(range(12))
    for node, (rod, cables, inner) in told.items():
        assert {node, int(rod)} in map(set, t.RODS)
        others = set(map(int, cables.split(", ")))
        assert others == {n for cable in t.CABLES if node in cable for n in cable} - {node}
        assert len(others) == 4
        assert inner == ("yes" if node in t.SERVO_NODES else "")


def test_minus_signs_are_real_and_zero_has_none():
    assert signed(-1.25, 1) == "−1.2"
    assert signed(-0.01, 1) == "0.0"
    assert signed(3.0, 2) == "3.00"
