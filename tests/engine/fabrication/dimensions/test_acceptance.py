"""What a technician measures tells a module that is not right from a good one."""

import dataclasses

import numpy as np
import pytest

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.as_built import twin_of
from engine.fabrication.dimensions.acceptance import expected, faults, measured
from engine.fabrication.materials import load_materials
from engine.simulation.built import Built, drawn
from engine.simulation.physics import Physics

ROBOTS = 3
LEVELS = (1, 5)


def good_robots(level: int) -> list[Built]:
    """Return robots of a design that differ in all that is not measured, lines within their tolerance."""
    twin = twin_of(Physics(), Morphology(level, (1, 2)), load_materials())
    spread = dataclasses.replace(twin.spread, stiffness=0.0, module_stiffness=0.0)
    robots = [drawn(twin.built, spread, (k,))[0] for k in range(ROBOTS)]
    # the pulses of a servo are set until it turns by 180 degrees
    errors = [tuple(np.clip(r.line_errors, -0.0005, 0.0005)) for r in robots]
    return [dataclasses.replace(r, line_errors=e, travel=180.0) for r, e in zip(robots, errors, strict=True)]


def with_stiffness(built: Built, factor: float) -> Built:
    return dataclasses.replace(built, module_stiffness=(factor,) * t.MAX_MODULES)


@pytest.mark.parametrize("level", LEVELS)
def test_good_modules_pass_and_stiff_ones_do_not(level):
    for robot in good_robots(level):
        assert faults(level, measured(level, robot)) == []
        assert faults(level, measured(level, with_stiffness(robot, 1.05))) == []
        assert faults(level, measured(level, with_stiffness(robot, 1.15))) == ["the cables are too stiff"]
        assert faults(level, measured(level, with_stiffness(robot, 0.85))) == ["the cables are too soft"]


@pytest.mark.parametrize("level", LEVELS)
def test_one_cable_too_stiff_is_found(level):
    for k, robot in enumerate(good_robots(level)):
        cables = np.ones(len(t.CABLES))
        cables[7 * k] = 1.15
        found = measured(level, robot, cables)
        a, b = t.CABLES[7 * k]
        assert any(text.startswith(f"the cable {a} - {b} is too stiff") for text in faults(level, found))
        # it is the one that is most too short
        assert int(found.spans.argmin()) == 7 * k


def test_a_short_line_is_found():
    for k, robot in enumerate(good_robots(5)):
        errors = np.array(robot.line_errors)
        errors[k] -= 0.002
        short = dataclasses.replace(robot, line_errors=tuple(errors))
        line = f"the line to node {t.SERVO_NODES[k]} has the wrong length"
        assert faults(5, measured(5, short)) == [line]


def test_the_shape_does_not_tell_the_stiffness_and_the_stretch_does():
    soft, stiff = expected(1), expected(10)
    np.testing.assert_allclose(soft.spans, stiff.spans, atol=1e-4)
    assert soft.stretch == pytest.approx(stiff.stretch, rel=0.02)
    assert 0.004 < soft.stretch < 0.02
