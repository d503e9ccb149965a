"""How a built robot differs from the simulated one, worked out from its design."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.as_built import Origin, deviations, search_physics, twin_of
from engine.fabrication.as_built.body import built_centre_of_mass
from engine.fabrication.as_built.twin import FEET_PAIRS
from engine.fabrication.bill_of_materials import parts
from engine.fabrication.dimensions.cables import cable_design
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import PRESETS, load_materials, parse_materials, preset_text
from engine.simulation.built import Built, Spread
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics, check_timestep

BODY = Morphology(5, (1, 8, 3))
FOOTED = dataclasses.replace(BODY, feet="end")
FEET = tuple(
    Foot(number=k, module=k, node=node, lean=60, clock=0, share=1.0, forward=0.1, backward=0.0, off=0.0)
    for k, node in enumerate((0, 5, 0))
)
FEET_TEST = """
[feet_test]
forward_degrees = [20, 22]
backward_degrees = [35, 40]
"""
PULL_TEST = """
[pull_test]
length_mm = 60
area_mm2 = 1.6
force_n = 9.6
extension_mm = 30
max_strain_percent = 65
"""


@pytest.mark.parametrize("preset", PRESETS)
def test_the_twin_weighs_what_the_parts_weigh(preset: str) -> None:
    materials = load_materials(preset)
    built = twin_of(Physics(), BODY, materials).built
    module = 5 * built.plain_rod_mass + built.servo_rod_mass
    assert BODY.n_modules * module == pytest.approx(mass_balance(BODY, materials).built)


@pytest.mark.parametrize("preset", PRESETS)
def test_every_difference_says_how_it_is_known(preset: str) -> None:
    found = deviations(BODY, load_materials(preset))
    assert len({d.key for d in found}) == len(found)
    for d in found:
        assert d.source
        assert d.remedy
        assert d.figures or d.scatter
    fields = [name for d in found for name in (*d.figures, *d.scatter)]
    known = {f.name for f in (*dataclasses.fields(Built), *dataclasses.fields(Spread))}
    assert set(fields) <= known
    check_timestep(twin_of(Physics(), BODY, load_materials(preset)).nominal)


def test_a_measurement_is_named_and_narrows_the_spread() -> None:
    guessed = twin_of(Physics(), BODY, load_materials("tpu-85a"))
    measured = twin_of(Physics(), BODY, parse_materials(preset_text("tpu-85a") + PULL_TEST, file="mine"))
    origins = [next(d.origin for d in twin.deviations if d.key == "cables") for twin in (guessed, measured)]
    assert origins == [Origin.ASSUMED, Origin.MEASURED]
    assert measured.spread.stiffness < guessed.spread.stiffness


@pytest.mark.parametrize("preset", PRESETS)
def test_the_centre_of_mass_is_built_where_it_was_simulated(preset: str) -> None:
    built = built_centre_of_mass(BODY, load_materials(preset))
    assert np.linalg.norm(built - t.SERVO_ROD_CENTRE_OF_MASS) < 0.002


def test_rods_without_a_bore_hold_no_limiter() -> None:
    tubes = load_materials()
    solid = dataclasses.replace(tubes, rod=dataclasses.replace(tubes.rod, bore=None))
    limited, bare = (twin_of(Physics(), BODY, m) for m in (tubes, solid))
    assert limited.built.line_limit == t.SERVO_MAX_TENSION
    assert limited.spread.line_limit > 0.0
    assert bare.built.line_limit == 0.0
    assert bare.spread.line_limit == 0.0
    assert len({p.built.line_limit for p in limited.samples(4)}) == 4
    assert {p.built.line_limit for p in bare.samples(4)} == {0.0}


def test_cables_that_can_be_made_have_the_simulated_stiffness() -> None:
    latex = twin_of(Physics(), BODY, load_materials("latex-sheet"), levels=range(1, 11)).built
    assert latex.stiffness == pytest.approx((1.0,) * 10, abs=0.01)
    # too soft for a nozzle of 0.4 mm
    printed = twin_of(Physics(), Morphology(1, (1, 8)), load_materials("tpu-85a")).built
    assert printed.stiffness[0] > 1.5


def test_a_twin_for_a_search_has_every_level() -> None:
    twin = twin_of(Physics(), BODY, load_materials("silicone-sheet"), levels=range(1, 11))
    assert [k for k, f in enumerate(twin.built.stiffness) if abs(f - 1.0) > 0.01] == [0]
    own = twin_of(Physics(), BODY, load_materials("tpu-85a")).built.stiffness
    assert own[:4] + own[5:] == (1.0,) * 9


def test_one_difference_alone_is_nothing_else() -> None:
    twin = twin_of(Physics(), BODY, load_materials("tpu-85a"))
    alone = twin.alone()
    assert alone["winding"].built == Built(winding="cams")
    assert "line_limit" not in alone
    assert "rest_length" not in alone
    assert "friction" not in alone
    # nothing is left that costs anything where robots were evolved as built
    assert twin_of(twin.nominal, BODY, load_materials("tpu-85a")).alone() == {}


def test_samples_differ_and_begin_alike() -> None:
    twin = twin_of(Physics(), BODY, load_materials("tpu-85a"))
    few, many = twin.samples(3), twin.samples(5)
    assert many[:3] == few
    assert len({p.friction for p in many}) == 5
    off = [np.subtract(p.built.centre_of_mass, twin.built.centre_of_mass) for p in many]
    assert np.abs(off).max() < 0.0031
    assert {p.built.winding for p in many} == {"cams"}


def test_the_simulated_stiffness_is_the_yardstick_of_a_measured_one() -> None:
    text = preset_text("latex-sheet").replace("# k_ref_n_per_m = 115.2", "k_ref_n_per_m = 57.6")
    built = twin_of(Physics(), BODY, parse_materials(text, file="mine")).built
    half = cable_design(5, parse_materials(text, file="mine"))
    assert half.stiffness == pytest.approx(t.stiffness_n_per_m(0.25))
    assert built.stiffness[4] < 0.9


def test_a_search_has_the_masses_of_the_level_asked_for() -> None:
    latex = load_materials()
    soft, stiff = (search_physics(Physics(), latex, spread=False, level=level).built for level in (2, 9))
    assert soft.plain_rod_mass < 1.15 * t.ROD_MASS
    assert stiff.plain_rod_mass > 1.3 * t.ROD_MASS
    assert soft.stiffness == stiff.stiffness
    assert not search_physics(Physics(), latex, spread=False).spread
    varied = search_physics(Physics(), latex, spread=True)
    assert varied.built == soft
    assert varied.spread.stiffness > 0.0


@pytest.mark.parametrize("preset", PRESETS)
def test_feet_are_weighed(preset: str) -> None:
    materials = load_materials(preset)
    built = twin_of(Physics(), FOOTED, materials, feet=FEET).built
    module = 5 * built.plain_rod_mass + built.servo_rod_mass
    balance = mass_balance(FOOTED, materials, FEET)
    assert FOOTED.n_modules * module == pytest.approx(balance.built)
    plain, worn = (
        next(x.built for x in b.lines if x.group == "plain rods")
        for b in (mass_balance(FOOTED, materials), balance)
    )
    assert worn - plain > 0.05e-3
    # two of them sit on node 0 of servo rods, at -y
    lighter = load_materials("latex-sheet")
    bare, shod = (built_centre_of_mass(FOOTED, lighter, feet)[1] for feet in ((), FEET))
    one = next(p.mass for p in parts(FOOTED, lighter, FEET) if p.name == "foot_060")
    heavy = twin_of(Physics(), FOOTED, lighter, feet=FEET).built.servo_rod_mass
    assert shod != bare
    assert abs(shod - bare) < 3 * one * t.ROD_LENGTH / heavy


def test_measured_feet_are_simulated_with_their_spread() -> None:
    guessed = twin_of(Physics(), FOOTED, load_materials())
    materials = parse_materials(preset_text("latex-sheet") + FEET_TEST, file="mine")
    measured = twin_of(Physics(), FOOTED, materials)
    assert guessed.nominal.feet_friction == (0.3, 0.8)
    assert measured.nominal.feet_friction == pytest.approx((0.384, 0.770), abs=1e-3)
    assert build_robot(FOOTED, measured.nominal).feet_friction == measured.nominal.feet_friction
    feet = [next(d for d in twin.deviations if d.key == "feet") for twin in (guessed, measured)]
    assert [d.origin for d in feet] == [Origin.ASSUMED, Origin.MEASURED]
    assert feet[0].simulated == "0.3 forward, 0.8 backward"
    assert measured.alone()["feet"].built == Built(**feet[1].figures)
    for twin, relative in ((guessed, 0.25), (measured, 0.071)):
        pairs = np.array([p.feet_friction for p in twin.samples(60)])
        assert pairs[:, 0].std() / pairs[:, 0].mean() == pytest.approx(relative, rel=0.35)
        assert (pairs[:, 1] >= pairs[:, 0]).all()
    without = twin_of(Physics(), BODY, materials)
    assert "feet" not in {d.key for d in without.deviations}
    assert without.built.feet_forward == 0.0
    assert search_physics(Physics(), materials, spread=True, footed=True).feet_friction == pytest.approx(
        measured.nominal.feet_friction
    )


def test_a_robot_with_feet_is_tried_with_worse_ones() -> None:
    twin = twin_of(Physics(), FOOTED, load_materials())
    assert {pair: p.feet_friction for pair, p in twin.feet_pairs().items()} == {p: p for p in FEET_PAIRS}
    assert twin_of(Physics(), BODY, load_materials()).feet_pairs() == {}


def test_a_robot_carries_a_part_of_its_tether_unless_it_carries_all() -> None:
    materials = load_materials()
    small, large = (
        twin_of(Physics(), Morphology(2, (1,) * n), materials).built.tether_mass * n for n in (2, 10)
    )
    # ten servos need thicker wires, and more of them
    assert 0.0 < 2 * small < large < 0.02
    carried = dataclasses.replace(
        materials,
        board=dataclasses.replace(materials.board, carried=True),
        battery=dataclasses.replace(materials.battery, carried=True),
    )
    twin = twin_of(Physics(), BODY, carried)
    assert (twin.built.tether_mass, twin.spread.tether_mass) == (0.0, 0.0)
    assert "tether" not in {d.key for d in twin.deviations}
