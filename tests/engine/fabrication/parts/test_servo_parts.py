import dataclasses
import itertools

import numpy as np
import pytest

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.buildability import problems
from engine.fabrication.dimensions.floating_module import floating_module
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import PRESETS, load_materials
from engine.fabrication.parts import drum, solids
from engine.fabrication.parts import servo_parts as sp
from engine.fabrication.parts.assembly import _servo_frame, servo_clearance

BODY = Morphology((3, 9), (1, 2))
MATERIALS = load_materials()


def test_servo_mount_drum_and_counterweight_have_room():
    motor = MATERIALS.servo
    left, right = sp.half_rods(MATERIALS)
    halves = [
        solids.bar((0, sign * 39.5, 0), (0, sign * (39.5 - 1e3 * length), 0), 1e3 * t.ROD_RADIUS)
        for sign, length in ((-1, left), (1, right))
    ]
    still = [sp.servo_mount(MATERIALS), sp.servo_body(motor), sp.ballast(MATERIALS), *halves]
    for a, b in itertools.combinations([*still, drum.drum_in_place(motor)], 2):
        assert (a ^ b).volume() < 1e-6
    for turned in (60, 120, 180):
        assert all((solid ^ drum.drum_in_place(motor, turned)).volume() < 1e-6 for solid in still)


@pytest.mark.parametrize("level", [1, 5, 10])
def test_nothing_in_a_module_meets_them(level):
    assert servo_clearance(level, MATERIALS) > 0.5
    for command in (0, 180):
        nodes = 1e3 * floating_module(level, command).nodes
        frame, middle = _servo_frame(nodes)
        solid = sp.servo_body(MATERIALS.servo) + sp.ballast(MATERIALS)
        solid = solid + drum.drum_in_place(MATERIALS.servo, command)
        for node in t.SERVO_NODES:
            # no internal cable cuts through the servo on its way
            end = (nodes[node] - middle) @ frame
            towards = (end - sp.guide_point()) / np.linalg.norm(end - sp.guide_point())
            line = solids.bar(sp.guide_point() + 4.2 * towards, end, 0.15)
            assert (solid ^ line).volume() == 0


def test_guide_holes_leave_the_ball_whole():
    holes = [sp.guide_direction(node) for node in t.SERVO_NODES]
    for a, b in itertools.combinations(holes, 2):
        apart = 1e3 * t.ACTUATOR_RADIUS * np.linalg.norm(a - b)
        assert apart > 1.2 + 0.8


def test_a_line_goes_straight_from_its_groove_into_the_mount():
    # the fairlead lies in the groove's plane, and the way there is free at both ends of the travel
    mount = sp.servo_mount(MATERIALS)
    for height, ways in zip(drum.groove_heights(), sp.line_ways(MATERIALS.servo), strict=True):
        x = drum.DRUM_HEIGHT + height
        for y, z in ways:
            line = solids.bar((x, y, z), (x, 0.0, 0.0), 0.3)
            assert (mount ^ line).volume() < 1e-6
            # and through the arm on to the ball
            assert (mount ^ solids.bar((x, 0, 0), sp.guide_point(), 0.3)).volume() < 1e-6


@pytest.mark.parametrize("preset", PRESETS)
def test_the_servo_rod_balances_near_its_simulated_centre(preset):
    materials = load_materials(preset)
    off = sp.servo_rod_centre_of_mass(materials) - np.array(t.SERVO_ROD_CENTRE_OF_MASS)
    assert np.linalg.norm(off) < 0.002
    balance = mass_balance(BODY, materials)
    line = next(x for x in balance.lines if x.group == "servo rod")
    assert "mm off the simulated one" in line.explanation
    # without what hangs on it alike it weighs what was simulated
    assert line.built / 2 == pytest.approx(t.SERVO_ROD_MASS, abs=0.0006)


def test_a_heavier_servo_needs_less_of_a_counterweight():
    heavy = dataclasses.replace(MATERIALS, servo=dataclasses.replace(MATERIALS.servo, mass=0.007))
    assert sp.ballast_length(heavy) < sp.ballast_length(MATERIALS) - 2.0
    off = [sp.servo_rod_centre_of_mass(m)[1] for m in (heavy, MATERIALS)]
    assert off[0] < off[1]


def test_a_limit_of_the_tension_spares_the_servo():
    bare, limited = (drum.line_tensions(10, limit) for limit in (0.0, t.SERVO_MAX_TENSION))
    assert bare.max() > t.SERVO_MAX_TENSION + 0.3
    assert limited.max() == pytest.approx(t.SERVO_MAX_TENSION)
    torques = [drum.required_torque(MATERIALS.servo, limit) for limit in (0.0, t.SERVO_MAX_TENSION)]
    assert torques[1] < 0.5 * MATERIALS.servo.torque
    assert torques[0] > 1.5 * torques[1]


def test_a_cap_that_meets_the_mount_is_told():
    body, long = (
        Morphology(5, (1, 2)),
        dataclasses.replace(MATERIALS.servo, body_length=0.03, shaft_offset=0.0),
    )
    for servo, meets in ((MATERIALS.servo, False), (long, True)):
        found = problems(body, dataclasses.replace(load_materials(), servo=servo))
        assert any("The cap of node 0 meets the mount" in p.text for p in found) == meets


@pytest.mark.parametrize("node", t.SERVO_NODES)
def test_a_line_goes_from_its_groove_through_the_arm_to_the_ball(node):
    materials = load_materials()
    first, arm, ball = sp.line_path(materials.servo, node)
    assert first[0] == arm[0]  # in the plane of its groove
    assert ball == pytest.approx(sp.guide_point())
    mount = sp.servo_mount(materials)
    way = solids.bar(first, arm, 0.3) + solids.bar(arm, ball, 0.3)
    assert (mount ^ way).volume() < 0.02 * way.volume()
    # it leaves the drum at its edge
    drum_there = drum.drum_in_place(materials.servo)
    assert drum_there.min_gap(solids.bar(first, np.add(first, (0.0, 0.01, 0.0)), 0.05), 5.0) < 1.0
