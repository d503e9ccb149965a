import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.fabrication.dimensions.rubber import pull, shear_modulus, slope, stretch_of
from engine.fabrication.materials import load_materials

LATEX = load_materials("latex-sheet").cable


def test_rubber_stretched_to_twice_its_length_pulls_as_worked_out_by_hand():
    assert pull(1.0) == 0.0
    assert pull(2.0) == pytest.approx(1.75)
    assert slope(2.0) == pytest.approx(1.25)
    # 0.86 MPa at 100 %, less 5 % after a day
    assert shear_modulus(LATEX) == pytest.approx(0.95 * 0.86e6 / 1.75)
    # the same rubber, named by another point of its curve: 1.5 - 1 / 2.25 at 50 %
    other = dataclasses.replace(LATEX, modulus=0.86e6 / 1.75 * (1.5 - 1 / 2.25) / 0.5, modulus_strain=0.5)
    assert shear_modulus(other) == pytest.approx(shear_modulus(LATEX))


@given(reach=st.floats(0.001, 0.04), length=st.floats(0.0401, 0.1))
def test_at_the_stretch_found_tension_over_stiffness_is_the_reach(reach, length):
    stretch = stretch_of(reach, length)
    assert stretch > 1.0
    assert length / stretch * pull(stretch) / slope(stretch) == pytest.approx(reach)
