import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cable_problems import cable_problems
from engine.fabrication.dimensions.cables import (
    LEAST_STRIP,
    MOST_STRIP,
    RING_RADIUS,
    cable_design,
    design_cables,
    spans,
)
from engine.fabrication.dimensions.floating_module import CONTRACTED, floating_module
from engine.fabrication.dimensions.rubber import pull, shear_modulus
from engine.fabrication.materials import (
    PRESETS,
    Source,
    load_materials,
    parse_materials,
    preset_text,
)

MATERIALS = {name: load_materials(name) for name in PRESETS}


def tension(design, materials, length):
    """Return what a cable of a design pulls with in N, its strip stretched to lengths in m."""
    return design.section.area * shear_modulus(materials.cable) * pull(length / design.free)


@given(
    level=st.integers(1, 10),
    modulus=st.floats(0.2e6, 50e6),
    strain=st.floats(0.2, 5.0),
    nozzle=st.sampled_from([0.0002, 0.0004, 0.0006]),
    name=st.sampled_from(PRESETS),
)
@settings(max_examples=40, deadline=None)
def test_a_cable_without_problems_pulls_as_the_simulated_spring(level, modulus, strain, nozzle, name):
    m = MATERIALS[name]
    m = dataclasses.replace(
        m,
        cable=dataclasses.replace(m.cable, modulus=modulus, max_strain=strain),
        printer=dataclasses.replace(m.printer, nozzle=nozzle),
    )
    body = Morphology(level, (1, 2))
    design, problems = design_cables(body, m)[0], cable_problems(body, m)
    assert t.CABLE_REST_LENGTH < design.free < spans(level, None).min()
    assert design.works == (not problems)
    if not problems:
        # in the assembled module: as strong, and growing as fast, as the spring
        span = spans(level, None).mean()
        simulated = design.stiffness * (floating_module(level, None).cables.mean() - t.CABLE_REST_LENGTH)
        assert tension(design, m, span) == pytest.approx(simulated, rel=0.01)
        assert design.tension == pytest.approx(simulated)
        rise = (tension(design, m, span + 1e-5) - tension(design, m, span - 1e-5)) / 2e-5
        assert rise == pytest.approx(design.stiffness, rel=0.01)
        assert max(design.strain_assembled, design.strain_contracted) <= strain * (1 + 1e-6)
        if m.cable.form == "printed":
            assert design.section.width >= nozzle - 1e-12
            assert design.section.thickness >= m.printer.min_layers * m.printer.layer - 1e-12
        else:
            assert LEAST_STRIP <= design.section.width <= MOST_STRIP
            assert design.section.thickness in m.cable.stock_thicknesses
    else:
        for problem in problems:
            assert problem.text.endswith(".")
            assert problem.proposals


@pytest.mark.parametrize("level", [1, 4, 10])
def test_it_stays_near_that_spring_while_the_module_contracts(level):
    m = MATERIALS["latex-sheet"]
    design = cable_design(level, m)
    lengths = floating_module(level, CONTRACTED).cables
    simulated = design.stiffness * (lengths - t.CABLE_REST_LENGTH)
    made = np.array([tension(design, m, span) for span in spans(level, CONTRACTED)])
    # a tenth, where the softest modules contract to a half; all are taut
    assert np.abs(made - simulated).max() < 0.11 * design.tension
    assert made.min() > 0.0


def test_a_cable_begins_to_stretch_at_the_rims():
    nodes = floating_module(5, None).nodes
    a, b = t.CABLES[0]
    between = np.linalg.norm(nodes[a] - nodes[b])
    assert between - 2 * RING_RADIUS < spans(5, None)[0] < between


@pytest.mark.parametrize("level", range(1, 11))
def test_every_stiffness_can_be_made_of_the_default(level):
    design = design_cables(Morphology(level, (1, 2)), load_materials())[0]
    assert design.works
    assert design.stiffness_made == pytest.approx(t.stiffness_n_per_m(level / 10), rel=0.01)


def test_a_measured_reference_stiffness_is_used():
    text = preset_text("tpu-85a").replace("# k_ref_n_per_m = 115.2", "k_ref_n_per_m = 100")
    materials = parse_materials(text, file="mine.toml")
    (design, _) = design_cables(Morphology(7, (1, 2)), materials)
    assert design.stiffness == pytest.approx(70.0)
    assert design.stiffness_source is Source.MEASURED
    (design, _) = design_cables(Morphology(7, (1, 2)), load_materials("tpu-85a"))
    assert design.stiffness == pytest.approx(t.stiffness_n_per_m(0.7))
