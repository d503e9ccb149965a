"""Every difference between a built robot and the simulated one: how large, how uncertain, and how one knows.

``docs/as_built.md`` explains each of them. What is derived from the design is *computed*; what somebody
entered in the materials file after a measurement is *measured*; all else is *assumed*, and says from where.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

import numpy as np

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.bill_of_materials import parts
from engine.fabrication.dimensions import limiter, tolerances
from engine.fabrication.dimensions.cables import CableDesign, cable_design
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.kit.power import tether_density
from engine.fabrication.materials import Materials
from engine.fabrication.parts.drum import drum_errors
from engine.fabrication.parts.servo_parts import servo_rod_centre_of_mass

TOLERANCE: Final = 2.0
"""A tolerance of the sheet is this many standard deviations."""
MODULUS_CHECKED: Final = tolerances.STIFFNESS / TOLERANCE
"""Standard deviation of a modulus from a data sheet, in parts of it. Batches differ by 20 %, but the sheet
begins with a pull test: outside its tolerance nothing is built before the measurement is entered."""
MODULUS_MEASURED: Final = 0.03
"""The same once it is entered: of a scale, and of a ruler at 60 mm."""
ELASTIC: Final = 0.15
"""Standard deviation of the stiffness of the elastic in an internal cable, in parts of it."""
SERVO_RATE: Final = 400.0
"""How fast a small servo turns under load, in degrees per second."""
SERVO_RATE_SPREAD: Final = 0.15
DEAD_PULSE: Final = 10.0
"""By how much a servo's pulse may change before it moves, in microseconds."""
DELAY: Final = 0.10
DELAY_SPREAD: Final = 0.03
"""Of camera, marker search and serial line, in s."""
POSITION_NOISE: Final = 0.003
"""Of a marker's place seen by a camera above the arena, in m."""
HEADING_NOISE: Final = 2.0
"""Of a marker's direction, in degrees."""
NOISE_SPREAD: Final = 0.5
FRICTION_SPREAD: Final = 0.15
"""Standard deviation of the friction of the floor, in parts of the coefficient."""
CARRIED: Final = 0.15
"""Metres of a tether that a robot carries: half of a loop that hangs 30 cm deep."""
TETHER_SPREAD: Final = 0.5
"""Standard deviation of that, in parts of it: a tight tether lifts, a long one lies on the robot."""
FEET_UNMEASURED: Final = 0.25
"""Standard deviation of both coefficients of feet that nobody has tested, in parts of them."""


class Origin(enum.StrEnum):
    """How a difference is known."""

    COMPUTED = "computed"
    """From the design and the materials."""
    MEASURED = "measured"
    """Somebody measured it and entered it in the materials file."""
    ASSUMED = "assumed"
    """From a data sheet, or by us."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """One difference between a built robot and the simulated one.

    Attributes:
        key: its short name, for tables and files.
        name: what it is, for people.
        simulated, built: the value there and here, for people, with units.
        spread: how robots differ from each other, for people; empty if they do not.
        origin: how the value is known.
        source: where from.
        remedy: what would make it smaller.
        figures: fields of ``simulation.built.Built`` and their values.
        scatter: fields of ``simulation.built.Spread`` and their values.
    """

    key: str
    name: str
    simulated: str
    built: str
    spread: str
    origin: Origin
    source: str
    remedy: str
    figures: dict[str, Any] = dataclasses.field(default_factory=dict)
    scatter: dict[str, float] = dataclasses.field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return JSON-ready values."""
        return dataclasses.asdict(self) | {"origin": str(self.origin)}


def deviations(
    morphology: Morphology,
    materials: Materials,
    levels: Iterable[int] | None = None,
    feet: tuple[Foot, ...] = (),
) -> tuple[Deviation, ...]:
    """Return every difference between a robot as built of some materials and as simulated.

    Args:
        morphology: its body.
        materials: what it is built from.
        levels: stiffness levels for which the figures hold; by default the body's own. A search needs all,
            and takes masses and centre of mass of a typical body for those of every other.
        feet: that it wears, for their masses.
    """
    wanted = sorted(set(morphology.stiffness_levels if levels is None else levels))
    makers: Sequence[Callable[[Morphology, Materials], Deviation]] = (
        functools.partial(_masses, feet=feet),
        functools.partial(_centre_of_mass, feet=feet),
        lambda _, materials: _cables(wanted, materials),
        _rest_length,
        _line_elastic,
        _line_limit,
        _line_lengths,
        _winding,
        _servo,
        _sensing,
        _friction,
        *(() if materials.board.carried and materials.battery.carried else (_tether,)),
        *((_feet,) if morphology.feet != "none" else ()),
    )
    return tuple(make(morphology, materials) for make in makers)


def _masses(morphology: Morphology, materials: Materials, feet: tuple[Foot, ...]) -> Deviation:
    plain, heavy = _rod_masses(morphology, materials, feet)
    return Deviation(
        key="mass",
        name="masses",
        simulated=f"{_g(t.ROD_MASS)} per plain rod, {_g(t.SERVO_ROD_MASS)} with servo",
        built=f"{_g(plain)} and {_g(heavy)}, with caps,{' feet,' if feet else ''} cables and links",
        spread=f"± {50 * tolerances.MASS:.0f} %",
        origin=Origin.COMPUTED,
        source="bill of materials",
        remedy="lighter caps or cables, or ballast where the module is too light",
        figures={"plain_rod_mass": plain, "servo_rod_mass": heavy},
        scatter={"mass": tolerances.MASS / TOLERANCE},
    )


def _rod_masses(morphology: Morphology, materials: Materials, feet: tuple[Foot, ...]) -> tuple[float, float]:
    """Return the masses in kg of a plain and of a servo rod, with what hangs on them.

    Passive cables and links hang on all rods alike, the internal cables on the servo rod.
    """
    groups: dict[str, float] = {}
    for part in parts(morphology, materials, feet):
        groups[part.group] = groups.get(part.group, 0.0) + part.quantity * part.mass
    n, rods = morphology.n_modules, len(t.RODS)
    shared = (groups["passive cables"] + groups.get("links", 0.0)) / (n * rods)
    plain = groups["plain rods"] / (n * (rods - 1)) + shared
    return plain, (groups["servo rod"] + groups["internal cables"]) / n + shared


def _centre_of_mass(morphology: Morphology, materials: Materials, feet: tuple[Foot, ...]) -> Deviation:
    middle = built_centre_of_mass(morphology, materials, feet)
    off = float(np.linalg.norm(middle - np.array(t.SERVO_ROD_CENTRE_OF_MASS)))
    x, y, z = (1e3 * v for v in middle)
    return Deviation(
        key="centre_of_mass",
        name="servo rod's centre of mass",
        simulated=f"{1e3 * t.SERVO_ROD_CENTRE_OF_MASS[0]:.1f} mm inwards of the rod's middle",
        built=f"{x:.1f} mm inwards, {y:.1f} mm along, {z:.1f} mm aside: {1e3 * off:.1f} mm off",
        spread="± 1 mm each way",
        origin=Origin.COMPUTED,
        source="solids of servo, mount, drum and counterweight",
        remedy="evolve with --as-built, whose bodies have the centre of mass that the design has",
        figures={"centre_of_mass": tuple(map(float, middle))},
        scatter={"centre_of_mass": 0.001},
    )


def built_centre_of_mass(
    morphology: Morphology, materials: Materials, feet: tuple[Foot, ...] = ()
) -> np.ndarray:
    """Return (3,) the mean centre of mass of servo rods with their feet, in m, in the rod's frame."""
    listed = parts(morphology, materials, feet)
    n = morphology.n_modules
    caps = sum(p.quantity * p.mass for p in listed if p.name.startswith("cap") and p.group == "servo rod")
    bare = servo_rod_centre_of_mass(materials, caps / n)
    total = sum(p.quantity * p.mass for p in listed if p.group == "servo rod") / n
    weighs = {p.name: p.mass for p in listed}
    # a foot sits on a node, which is half a rod away from the middle
    ends = {a: np.sign(t.NODES[a, 1]) * t.ROD_LENGTH / 2 for a in t.RODS[t.SERVO_ROD]}
    worn = [(weighs[f.part] / n, ends[f.node]) for f in feet if f.node in ends]
    moment = np.array([0.0, sum(mass * place for mass, place in worn), 0.0])
    others = total - sum(mass for mass, _ in worn)
    return np.asarray((others * bare + moment) / total)


def _cables(levels: Sequence[int], materials: Materials) -> Deviation:
    designs = {level: cable_design(level, materials) for level in levels}
    factors = [1.0] * t.N_STIFFNESS_LEVELS
    for level, d in designs.items():
        factors[level - 1] = d.stiffness_made / _wanted(d)
    own = sorted({f"{factors[level - 1]:.2f}" for level in levels})
    built = f"{' to '.join((own[0], own[-1]) if len(own) > 1 else own)} times that"
    if not all(d.producible for d in designs.values()):
        built += ": the section asked for cannot be made"
    if not all(d.springs_back for d in designs.values()):
        built += ": it is strained beyond what it springs back from"
    material = MODULUS_MEASURED if materials.pull_test else MODULUS_CHECKED
    module = tolerances.STIFFNESS / TOLERANCE
    guess = f"modulus of {materials.name}, checked by a pull test: {materials.cable.source or 'no source'}"
    return Deviation(
        key="cables",
        name="stiffness of the passive cables",
        simulated=", ".join(f"{t.stiffness_n_per_m(level / 10):.1f}" for level in levels) + " N/m",
        built=built,
        spread=f"± {100 * material:.0f} % all alike, ± {100 * module:.0f} % by module",
        origin=Origin.MEASURED if materials.pull_test else Origin.ASSUMED,
        source="pull test" if materials.pull_test else guess,
        remedy="a pull test, entered in the materials file, and exporting again; or another material",
        figures={"stiffness": tuple(factors)},
        scatter={"stiffness": material, "module_stiffness": module},
    )


def _wanted(design: CableDesign) -> float:
    """Return the simulated stiffness of a cable in N/m: a measured ``k_ref`` is no reason for another."""
    return t.stiffness_n_per_m(design.level / t.N_STIFFNESS_LEVELS)


def _rest_length(_morphology: Morphology, _materials: Materials) -> Deviation:
    return Deviation(
        key="rest_length",
        name="rest length of the passive cables",
        simulated=f"{1e3 * t.CABLE_REST_LENGTH:.2f} mm",
        built=f"as if it were {1e3 * t.CABLE_REST_LENGTH:.2f} mm, in the assembled module",
        spread=f"± {1e3 * tolerances.REST / TOLERANCE:.2f} mm",
        origin=Origin.ASSUMED,
        source="half the sheet's tolerance",
        remedy="nets cut within the tolerance",
        scatter={"rest_length": tolerances.REST / TOLERANCE},
    )


def _line_elastic(_morphology: Morphology, materials: Materials) -> Deviation:
    return Deviation(
        key="line_elastic",
        name="elastic of the internal cables",
        simulated=f"{t.SERVO_GAIN:g} N/m",
        built=f"{t.SERVO_GAIN:g} N/m",
        spread=f"± {100 * ELASTIC:.0f} %",
        origin=Origin.ASSUMED,
        source=materials.line.elastic,
        remedy="choose the elastic by hanging a mass on it",
        scatter={"line_stiffness": ELASTIC},
    )


def _line_limit(_morphology: Morphology, materials: Materials) -> Deviation:
    if limiter.has_limiter(materials):
        return Deviation(
            key="line_limit",
            name="largest tension of an internal cable",
            simulated=f"{t.SERVO_MAX_TENSION:g} N",
            built=f"{t.SERVO_MAX_TENSION:g} N, by a stretched thread in the rod",
            spread=f"± {100 * limiter.SPREAD:.0f} %",
            origin=Origin.ASSUMED,
            source=f"a thread of {limiter.GROWTH:.0f} N/m, adjusted with a weight; friction at the cap",
            remedy="adjust the thread with the weight, in the cable's direction",
            scatter={"line_limit": limiter.SPREAD},
        )
    return Deviation(
        key="line_limit",
        name="largest tension of an internal cable",
        simulated=f"{t.SERVO_MAX_TENSION:g} N",
        built="none: nothing gives way",
        spread="",
        origin=Origin.COMPUTED,
        source="a line with an elastic in it has no limit",
        remedy="tubes as rods, which a limiter fits into, or evolve with --as-built",
        figures={"line_limit": 0.0},
    )


def _line_lengths(_morphology: Morphology, _materials: Materials) -> Deviation:
    return Deviation(
        key="line_lengths",
        name="length of each internal cable",
        simulated="as the servo table says",
        built="as the servo table says at both ends",
        spread=f"± {1e3 * tolerances.INTERNAL_CABLE / TOLERANCE:.2f} mm",
        origin=Origin.ASSUMED,
        source="half the sheet's tolerance",
        remedy="tie the lines by the table, servo at 0°",
        scatter={"line_errors": tolerances.INTERNAL_CABLE / TOLERANCE},
    )


def _winding(_morphology: Morphology, _materials: Materials) -> Deviation:
    return Deviation(
        key="winding",
        name="how the drum winds",
        simulated="the published table",
        built=f"by cams: up to {max(drum_errors()):.1f} mm off in between",
        spread=f"± {tolerances.TRAVEL / TOLERANCE:.1f}° of travel",
        origin=Origin.COMPUTED,
        source="outlines of the drum's cams",
        remedy="evolve with --as-built",
        figures={"winding": "cams"},
        scatter={"travel": tolerances.TRAVEL / TOLERANCE},
    )


def _servo(_morphology: Morphology, materials: Materials) -> Deviation:
    motor = materials.servo
    dead = motor.travel * DEAD_PULSE / (motor.pulse_max - motor.pulse_min)
    return Deviation(
        key="servo",
        name="rate and dead band of the servos",
        simulated="at once, exactly",
        built=f"{SERVO_RATE:.0f}° per second at most, still within {dead:.1f}°",
        spread=f"± {100 * SERVO_RATE_SPREAD:.0f} % of the rate",
        origin=Origin.ASSUMED,
        source="data sheets of small servos: 0.10 to 0.12 s for 60° without load, dead band 5 to 10 µs",
        remedy="a digital servo",
        figures={"servo_rate": SERVO_RATE, "dead_band": dead},
        scatter={"servo_rate": SERVO_RATE_SPREAD},
    )


def _sensing(_morphology: Morphology, _materials: Materials) -> Deviation:
    return Deviation(
        key="sensing",
        name="delay and noise of the camera",
        simulated="at once, exactly",
        built=f"{DELAY:g} s late; {1e3 * POSITION_NOISE:g} mm and {HEADING_NOISE:g}° of noise",
        spread=f"± {DELAY_SPREAD:g} s; half of the noise",
        origin=Origin.ASSUMED,
        source="camera at 30 pictures a second, printed marker, serial line",
        remedy="a faster camera",
        figures={
            "sensing_delay": DELAY,
            "position_noise": POSITION_NOISE,
            "heading_noise": HEADING_NOISE,
        },
        scatter={"sensing_delay": DELAY_SPREAD, "sensing_noise": NOISE_SPREAD},
    )


def _friction(_morphology: Morphology, _materials: Materials) -> Deviation:
    return Deviation(
        key="friction",
        name="friction of the floor",
        simulated="as in the run",
        built="as in the run: choose the floor by it",
        spread=f"± {100 * FRICTION_SPREAD:.0f} %",
        origin=Origin.ASSUMED,
        source="a floor found by the sheet's tilting test",
        remedy="paper or cloth on the floor, chosen by the tilting test",
        scatter={"friction": FRICTION_SPREAD},
    )


def _tether(morphology: Morphology, materials: Materials) -> Deviation:
    density, n = tether_density(morphology.n_modules, materials.servo), morphology.n_modules
    each = CARRIED * density / n
    return Deviation(
        key="tether",
        name="weight of the tether",
        simulated="none",
        built=f"{_g(each)} on every servo rod: {1e3 * density:.0f} g/m, of which the robot carries"
        f" {100 * CARRIED:.0f} cm",
        spread=f"± {100 * TETHER_SPREAD:.0f} %",
        origin=Origin.ASSUMED,
        source="wires of the table “Power”, hung from above, with slack",
        remedy="thinner wires, hung from above, with a loop that just does not lift the robot",
        figures={"tether_mass": each},
        scatter={"tether_mass": TETHER_SPREAD * each},
    )


def _feet(_morphology: Morphology, materials: Materials) -> Deviation:
    test = materials.feet_test
    names = ("feet_forward", "feet_backward")
    if test is None:
        return Deviation(
            key="feet",
            name="friction of the feet",
            simulated="as in the run",
            built="as in the run: nobody has measured it",
            spread=f"± {100 * FEET_UNMEASURED:.0f} % each",
            origin=Origin.ASSUMED,
            source="no friction test",
            remedy="the friction test, entered in the materials file, and exporting again",
            scatter=dict.fromkeys(names, FEET_UNMEASURED),
        )
    forward, backward = test.friction
    spread = test.spread
    return Deviation(
        key="feet",
        name="friction of the feet",
        simulated="as in the run",
        built=f"{forward:.2f} forward, {backward:.2f} backward",
        spread=f"± {100 * spread[0]:.0f} % and ± {100 * spread[1]:.0f} %",
        origin=Origin.MEASURED,
        source=f"friction test, {len(test.forward)} and {len(test.backward)} angles",
        remedy="another floor or filament, or evolving with the measured pair",
        figures=dict(zip(names, (forward, backward), strict=True)),
        scatter=dict(zip(names, spread, strict=True)),
    )


def _g(kilograms: float) -> str:
    return f"{1e3 * kilograms:.2f} g"
