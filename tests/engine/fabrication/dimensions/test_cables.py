import dataclasses
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cable_problems import cable_problems
from engine.fabrication.dimensions.cables import CAP_BEND, EYELET_WALL, design_cables, working_length
from engine.fabrication.materials import (
    MAX_TAIL,
    MIN_TAIL,
    PRESETS,
    Source,
    load_materials,
    parse_materials,
    preset_text,
)

MATERIALS = {name: load_materials(name) for name in PRESETS}


@given(
    level=st.integers(1, 10),
    modulus=st.floats(0.2e6, 50e6),
    strain=st.floats(0.2, 5.0),
    nozzle=st.sampled_from([0.0002, 0.0004, 0.0006]),
    name=st.sampled_from(PRESETS),
)
@settings(max_examples=40, deadline=None)
def test_a_cable_without_problems_is_the_simulated_spring(level, modulus, strain, nozzle, name):
    m = MATERIALS[name]
    m = dataclasses.replace(
        m,
        cable=dataclasses.replace(m.cable, modulus=modulus, max_strain=strain),
        printer=dataclasses.replace(m.printer, nozzle=nozzle),
    )
    body = Morphology(level, (1, 2))
    design, problems = design_cables(body, m)[0], cable_problems(body, m)
    assert MIN_TAIL - 1e-12 <= design.tail <= MAX_TAIL
    assert design.path == pytest.approx(t.CABLE_REST_LENGTH + 2 * design.tail)
    relaxed = modulus * (1.0 - m.cable.relaxation_after_a_day)
    assert design.area == pytest.approx(design.stiffness * design.working / relaxed)
    assert t.CABLE_REST_LENGTH < design.working < design.free
    assert math.pi / 4 * design.round_diameter**2 == pytest.approx(design.square_side**2)
    assert design.works == (not problems)
    if not problems:
        assert design.stiffness_made == pytest.approx(design.stiffness, rel=0.01)
        assert max(design.strain_assembled, design.strain_contracted) <= strain * (1 + 1e-6)
        if not design.section.round:
            assert design.section.width >= nozzle - 1e-12
            assert design.section.thickness >= m.printer.min_layers * m.printer.layer - 1e-12
        else:
            assert design.section.width in m.cable.stock_diameters
    else:
        for problem in problems:
            assert problem.text.endswith(".")
            assert problem.proposals


def test_a_tail_takes_part_as_far_as_it_slides():
    cable = MATERIALS["latex-cord"].cable
    free = t.CABLE_REST_LENGTH + 0.02
    assert working_length(0.01, cable, friction=0.0) == pytest.approx(free)
    assert working_length(0.01, cable, friction=50.0) == pytest.approx(t.CABLE_REST_LENGTH)
    # pulled at the span's tension 1, the tails have 1 / e where friction times the bend is 1
    stretched = t.CABLE_REST_LENGTH + 0.02 / math.e
    assert working_length(0.01, cable, friction=1.0 / CAP_BEND) == pytest.approx(stretched)


@pytest.mark.parametrize("level", range(1, 11))
def test_every_stiffness_can_be_made_of_the_default(level):
    design = design_cables(Morphology(level, (1, 2)), load_materials())[0]
    assert design.works
    assert design.stiffness_made == pytest.approx(t.stiffness_n_per_m(level / 10), rel=0.01)


def test_printed_rings_count_as_rigid():
    design = design_cables(Morphology(5, (1, 2)), MATERIALS["tpu-85a"])[0]
    assert design.free == pytest.approx(design.path - 2 * EYELET_WALL)
    cord = design_cables(Morphology(5, (1, 2)), MATERIALS["latex-cord"])[0]
    assert cord.free == pytest.approx(cord.path)


def test_a_measured_reference_stiffness_is_used():
    text = preset_text("tpu-85a").replace("# k_ref_n_per_m = 115.2", "k_ref_n_per_m = 100")
    materials = parse_materials(text, file="mine.toml")
    (design, _) = design_cables(Morphology(7, (1, 2)), materials)
    assert design.stiffness == pytest.approx(70.0)
    assert design.stiffness_source is Source.MEASURED
    (design, _) = design_cables(Morphology(7, (1, 2)), load_materials("tpu-85a"))
    assert design.stiffness == pytest.approx(t.stiffness_n_per_m(0.7))
