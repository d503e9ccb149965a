"""How a built robot's internal cables, drums and servos differ from the simulated ones."""

from __future__ import annotations

from typing import Final

from engine.body import module as t
from engine.fabrication.as_built.deviation import TOLERANCE, Deviation, Origin
from engine.fabrication.dimensions import limiter, tolerances
from engine.fabrication.materials import Materials
from engine.fabrication.parts.drum import drum_errors

ELASTIC: Final = 0.15
"""Standard deviation of the stiffness of the elastic in an internal cable, in parts of it."""
SERVO_RATE: Final = 400.0
"""How fast a small servo turns under load, in degrees per second."""
SERVO_RATE_SPREAD: Final = 0.15
DEAD_PULSE: Final = 10.0
"""By how much a servo's pulse may change before it moves, in microseconds."""


def line_elastic(materials: Materials) -> Deviation:
    """Return the deviation of the stiffness of the elastic in the internal cables."""
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


def line_limit(materials: Materials) -> Deviation:
    """Return the deviation of the largest tension of an internal cable."""
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


def line_lengths() -> Deviation:
    """Return the deviation of the lengths of the internal cables."""
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


def winding() -> Deviation:
    """Return the deviation of how the drums wind the internal cables."""
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


def servo(materials: Materials) -> Deviation:
    """Return the deviation of the rate and the dead band of the servos."""
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
