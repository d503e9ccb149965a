"""How camera, floor, tether and feet differ from what a simulation takes for granted."""

from __future__ import annotations

from typing import Final

from engine.body.morphology import Morphology
from engine.fabrication.as_built.deviation import Deviation, Origin, grams
from engine.fabrication.kit.power import tether_density
from engine.fabrication.materials import Materials

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


def sensing() -> Deviation:
    """Return the deviation of the delay and the noise of what tells the controller where the robot is."""
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


def friction() -> Deviation:
    """Return the deviation of the friction of the floor."""
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


def tether(morphology: Morphology, materials: Materials) -> Deviation:
    """Return the deviation of the weight of the wires that a robot carries."""
    density, n = tether_density(morphology.n_modules, materials.servo), morphology.n_modules
    each = CARRIED * density / n
    return Deviation(
        key="tether",
        name="weight of the tether",
        simulated="none",
        built=f"{grams(each)} on every servo rod: {1e3 * density:.0f} g/m, of which the robot carries"
        f" {100 * CARRIED:.0f} cm",
        spread=f"± {100 * TETHER_SPREAD:.0f} %",
        origin=Origin.ASSUMED,
        source="wires of the table “Power”, hung from above, with slack",
        remedy="thinner wires, hung from above, with a loop that just does not lift the robot",
        figures={"tether_mass": each},
        scatter={"tether_mass": TETHER_SPREAD * each},
    )


def feet(materials: Materials) -> Deviation:
    """Return the deviation of the friction of the feet, as measured if it was."""
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
