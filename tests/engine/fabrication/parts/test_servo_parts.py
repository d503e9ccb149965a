import itertools

import numpy as np
import pytest

from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.floating_module import floating_module
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import load_materials
from engine.fabrication.parts import servo_parts as sp
from engine.fabrication.parts import solids
from engine.fabrication.parts.assembly import servo_clearance

BODY = Morphology((3, 9), (1, 2))
MATERIALS = load_materials("tpu-85a")


def test_the_drum_winds_the_strokes_of_the_simulated_table():
    radii = sp.groove_radii(MATERIALS.servo)
    assert np.pi * radii == pytest.approx(1e3 * (servo.TARGET_LENGTHS[0] - servo.TARGET_LENGTHS[180]))
    assert sp.drum_errors(MATERIALS.servo).max() < 3.6
    drum = sp.servo_drum(MATERIALS.servo)
    for k, node in enumerate(sp.drum_order(MATERIALS.servo)):
        z = sp.FLANGE + k * (sp.FLANGE + sp.GROOVE) + sp.GROOVE / 2
        section = drum.slice(z)
        r = radii[t.SERVO_NODES.index(node)]
        assert max(section.bounds()) == pytest.approx(r, abs=0.02)


def test_servo_mount_and_drum_have_room():
    motor = MATERIALS.servo
    mount, body = sp.servo_mount(motor, MATERIALS.printer), sp.servo_body(motor)
    drum = sp.drum_in_place(motor)
    rod = solids.bar((0, -41, 0), (0, 41, 0), 1e3 * t.ROD_RADIUS)
    for a, b in itertools.combinations((mount, body, drum, rod), 2):
        assert (a ^ b).volume() < 1e-6
    for level in (1, 5, 10):
        assert servo_clearance(level, MATERIALS) > 0.9
        nodes = 1e3 * floating_module(level, 180).nodes
        a, b = nodes[0], nodes[1]
        y = (b - a) / np.linalg.norm(b - a)
        x = -(a + b) / 2
        x = (x - y * (x @ y)) / np.linalg.norm(x - y * (x @ y))
        frame = np.stack([x, y, np.cross(x, y)], axis=1)
        for node in t.SERVO_NODES:
            # no internal cable cuts through the servo on its way
            end = (nodes[node] - (a + b) / 2) @ frame
            towards = (end - sp.guide_point()) / np.linalg.norm(end - sp.guide_point())
            line = solids.bar(sp.guide_point() + 4.2 * towards, end, 0.15)
            assert all((solid ^ line).volume() == 0 for solid in (mount, body, drum))


def test_guide_holes_leave_the_ball_whole():
    holes = [sp.guide_direction(node) for node in t.SERVO_NODES]
    for a, b in itertools.combinations([*holes, sp.line_entry(MATERIALS.servo)], 2):
        apart = 1e3 * t.ACTUATOR_RADIUS * np.linalg.norm(a - b)
        assert apart > 1.2 + 0.8


def test_the_servo_rods_centre_of_mass_is_told():
    box = solids.box((1, 2, 3), (5, 4, 4)) + solids.box((11, 2, 3), (15, 4, 4))
    assert solids.centroid(box) == pytest.approx([8, 3, 3.5])
    centre = sp.servo_rod_centre_of_mass(MATERIALS, 0.0015)
    far = np.linalg.norm(centre - np.array(t.SERVO_ROD_CENTRE_OF_MASS))
    line = next(x for x in mass_balance(BODY, MATERIALS).lines if x.group == "servo rod")
    assert f"lies {1e3 * far:.0f} mm off the simulated one" in line.explanation
    # the heavy servo lies on the quarter where its axis is
    assert np.sign(centre[1:]) == pytest.approx(np.sign(sp.SERVO_AXIS))


def test_lines_without_a_limit_pull_more_and_a_servo_holds_them():
    soft, stiff = (sp.line_tensions(level) for level in (1, 10))
    assert stiff.max() > t.SERVO_MAX_TENSION > soft.max()
    torque = sp.required_torque(MATERIALS.servo)
    assert torque > 1e-3 * sp.groove_radii(MATERIALS.servo).sum() * t.SERVO_MAX_TENSION
    assert torque < MATERIALS.servo.torque
