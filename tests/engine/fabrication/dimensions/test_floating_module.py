"""What a finished module must measure, against the module that is simulated."""

import numpy as np
import pytest

from engine.body import module as t
from engine.fabrication.dimensions import tolerances
from engine.fabrication.dimensions.floating_module import CONTRACTED, RELEASED, contraction, floating_module


@pytest.mark.parametrize("level", [1, 4, 10])
def test_the_distances_are_the_simulated_modules(level):
    released, contracted = (floating_module(level, c).nodes for c in (RELEASED, CONTRACTED))
    for d in contraction(level):
        a, b = d.nodes
        assert d.released == pytest.approx(np.linalg.norm(released[a] - released[b]))
        assert d.contracted == pytest.approx(np.linalg.norm(contracted[a] - contracted[b]))
        assert set(d.nodes) <= set(t.SERVO_NODES)
        assert t.rod_of(a) != t.rod_of(b)


def test_a_soft_module_contracts_more_and_a_badly_tied_one_is_found():
    strokes = [contraction(level)[0].released - contraction(level)[0].contracted for level in (1, 4, 10)]
    assert strokes == sorted(strokes, reverse=True)
    for level in (1, 4, 10):
        d = contraction(level)[0]
        a, b = d.nodes
        far = floating_module(level, CONTRACTED, 20 * tolerances.INTERNAL_CABLE).nodes
        assert abs(np.linalg.norm(far[a] - far[b]) - d.contracted) > d.tolerance
        assert 0 < d.tolerance < (d.released - d.contracted) / 4
