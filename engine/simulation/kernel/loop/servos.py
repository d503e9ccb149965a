"""From a network's outputs to the commanded lengths of the internal cables, for all lanes at once.

A module contracts at one of a few frequencies and phases, so that at any time there are only a few different
commands: they are worked out once, and each lane picks its own. ``engine.body.servo`` has
the numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from engine.body.servo import FREQUENCIES, PHASES
from engine.simulation.built import Built
from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import (
    Integer,
    Real,
    Reals,
    by_lane,
    integers,
    load,
    load_lane,
    mask_to_integer,
    maximum,
    minimum,
    reals,
    select,
    store,
    store_lane,
    to_bits,
)
from engine.simulation.kernel.lanes.transcendental import sine_and_cosine
from engine.simulation.kernel.loop.network import Networks
from engine.simulation.kernel.robots.parameters import INTERNAL

N_COMMANDS: Final = len(FREQUENCIES) * len(PHASES)
"""Different commands at any time: phase p of frequency f is number f x phases + p."""
_HALF_TURN: Final = 180.0
_TWO_PI: Final = 2.0 * math.pi


class Servos(NamedTuple):
    """What the servos of the lanes' robot can do, and memory to work in.

    Attributes:
        lengths: (181, 5) target lengths in m at 0, 1, ... 180 degrees.
        frequency, phase: vectors that hold the commands' frequencies in Hz and phases in rad, in order.
        angle: vectors that hold the commands at one time, in degrees.
        targets: (commands, 5) target lengths in m at one time.
        n_frequencies, n_phases: how many of each there are to choose from.
        pair: (networks x modules,) which pair of a network's outputs drives a module.
        choice: (modules,) vectors of integers: the command that a module has.
        step: by how much a servo turns at most in a control period, in degrees; 0 for as much as commanded.
        dead_band: how far a servo may be from its command without moving, in degrees.
        stands: (modules,) vectors: where the servos stand, in degrees; followed if one of the two is not 0.
        errors: (modules x 5,) how much longer than commanded the internal cables are, in m; none if they are
            not.
    """

    lengths: np.ndarray
    frequency: Reals
    phase: Reals
    angle: Reals
    targets: np.ndarray
    n_frequencies: int
    n_phases: int
    pair: np.ndarray
    choice: np.ndarray
    step: float
    dead_band: float
    stands: Reals
    errors: np.ndarray


def make_servos(
    pairs: Sequence[Sequence[int]], built: Built, period: float, *, n_modules: int, width: int
) -> Servos:
    """Return the servos of robots whose modules are driven by these pairs of outputs, network by network.

    Args:
        pairs: network by network and module by module.
        built: what the robots are like.
        period: between two control updates, in s.
        n_modules: of each robot.
        width: of the vectors.
    """
    assert N_COMMANDS % width == 0
    frequency, phase, angle = (reals(N_COMMANDS // width, width=width) for _ in range(3))
    by_lane(frequency).ravel()[:] = np.repeat(FREQUENCIES, len(PHASES))
    by_lane(phase).ravel()[:] = np.tile(PHASES, len(FREQUENCIES))
    return Servos(
        built.target_lengths().copy(),
        frequency,
        phase,
        angle,
        np.zeros((N_COMMANDS, INTERNAL)),
        len(FREQUENCIES),
        len(PHASES),
        np.array(pairs, np.int64).ravel(),
        integers(n_modules, width=width),
        built.servo_rate * period,
        built.dead_band,
        reals(n_modules, width=width),
        built.errors_of(n_modules).ravel() if built.line_errors else np.empty(0),
    )


@inlined
def turn(servos: Servos, time: float) -> None:
    """Work out all commands' target lengths.

    Args:
        servos: whose.
        time: seconds since the robots were dropped.
    """
    for k in range(len(servos.angle)):
        sine, _ = sine_and_cosine((load(servos.frequency, k) * _TWO_PI) * time + load(servos.phase, k))
        store(servos.angle, k, minimum(maximum(90.0 * (sine + 1.0), 0.0), _HALF_TURN))
    width = servos.angle.itemsize // 8
    last = len(servos.lengths) - 2
    for k in range(len(servos.targets)):
        angle = load_lane(servos.angle, k // width, k % width)
        below = min(int(angle), last)
        part = angle - below
        for cable in range(INTERNAL):
            low, high = servos.lengths[below, cable], servos.lengths[below + 1, cable]
            servos.targets[k, cable] = low * (1.0 - part) + high * part


@inlined
def _pick(output: Real, n: int) -> Integer:
    """Return item min(floor(output x n), n - 1) of n, and 0 for NaN."""
    scaled = output * float(n)
    index = to_bits(output) & 0
    for k in range(1, n):
        index = index + mask_to_integer(scaled >= float(k))
    return index


@inlined
def choose(servos: Servos, networks: Networks, values: Reals) -> None:
    """Let networks choose the commands of every module.

    Args:
        servos: whose.
        networks: the networks, whose last outputs are a frequency and a phase for each pair.
        values: their inputs and nodes' values.
    """
    n = len(servos.choice)
    for k in range(len(networks.end)):
        first = networks.n_inputs + networks.end[k] - 2 * n
        here = load(networks.lanes, k) != 0
        for module in range(n):
            output = first + 2 * servos.pair[n * k + module]
            frequency, phase = load(values, output), load(values, output + 1)
            index = _pick(frequency, servos.n_frequencies) * servos.n_phases
            index = index + _pick(phase, servos.n_phases)
            store(servos.choice, module, select(here, index, load(servos.choice, module)))


@inlined
def set_at_once(servos: Servos, commanded: Reals) -> None:
    """Set the commanded lengths to what was chosen; every servo is there at once."""
    width = commanded.itemsize // 8
    for module in range(len(servos.choice)):
        for lane in range(width):
            k = load_lane(servos.choice, module, lane)
            for cable in range(INTERNAL):
                store_lane(commanded, INTERNAL * module + cable, lane, servos.targets[k, cable])


@inlined
def follow(servos: Servos, commanded: Reals) -> None:
    """Turn every servo towards what was chosen, and set the commanded lengths to where it stands."""
    width = commanded.itemsize // 8
    last = len(servos.lengths) - 2
    for module in range(len(servos.choice)):
        for lane in range(width):
            k = load_lane(servos.choice, module, lane)
            stands = load_lane(servos.stands, module, lane)
            off = load_lane(servos.angle, k // width, k % width) - stands
            if abs(off) > servos.dead_band:
                if servos.step > 0.0:
                    off = min(max(off, -servos.step), servos.step)
                stands += off
                store_lane(servos.stands, module, lane, stands)
            below = min(int(stands), last)
            part = stands - below
            for cable in range(INTERNAL):
                low, high = servos.lengths[below, cable], servos.lengths[below + 1, cable]
                store_lane(commanded, INTERNAL * module + cable, lane, low * (1.0 - part) + high * part)


@inlined
def command(servos: Servos, commanded: Reals) -> None:
    """Set the commanded lengths, (modules x 5,) vectors in m, to what was chosen."""
    if servos.step > 0.0 or servos.dead_band > 0.0:
        follow(servos, commanded)
    else:
        set_at_once(servos, commanded)
    for k in range(len(servos.errors)):
        store(commanded, k, load(commanded, k) + servos.errors[k])
