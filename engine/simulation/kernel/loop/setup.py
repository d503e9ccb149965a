"""What drives the lanes' robots, and where to write down what they do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple, Protocol

import numpy as np

from engine.control.genome import Controller
from engine.simulation.kernel.lanes.simd import Integers, Reals, integers, reals
from engine.simulation.kernel.loop.network import Networks, compile_networks, no_networks
from engine.simulation.kernel.loop.noise import streams
from engine.simulation.kernel.loop.sensing import Scene
from engine.simulation.kernel.loop.servos import Servos, make_servos
from engine.simulation.kernel.robots.model import Model
from engine.simulation.kernel.robots.parameters import INTERNAL, RODS
from engine.simulation.physics import Physics

RELEASED: Final = 0
"""The servos are off."""
OPEN_LOOP: Final = 1
"""Every module keeps its command, that of number ``servos.choice``, without noise."""
CONTROLLER: Final = 2
"""The networks choose the commands, to which noise is added."""


class Rhythm(NamedTuple):
    """When things happen.

    Attributes:
        n_steps: time steps in a control update.
        period: seconds between two control updates.
        per_second: control updates in a second.
        start: control updates between the drop and the beginning of this loop.
    """

    n_steps: int
    period: float
    per_second: int
    start: int


class Loop(NamedTuple):
    """What drives the lanes' robots, and what belongs to it.

    Attributes:
        drive: ``RELEASED``, ``OPEN_LOOP`` or ``CONTROLLER``.
        rhythm: when things happen.
        scene: what is sensed.
        networks: that drive the lanes.
        values: their inputs and nodes' values.
        servos: the robots'.
        streams: (4,) vectors of integers: the lanes' noise.
        draws: (modules x 5,) vectors to draw noise into, then one for every number of ``blur``.
        noise: standard deviation of the noise on a commanded length, in m.
        delay: control updates that the networks are told their inputs late.
        memory: (delay x inputs,) vectors: what was sensed in the last ones.
        blur: (inputs,) standard deviations of the noise on what the networks are told; none if there is none.
        clock: (1,) control updates since the drop.
        failed_at: one vector of integers: control updates from the drop to a simulation's failure, or to the
            beginning of this loop if it had failed before; else 0.
        head: (2,) vectors: where the heads are in the frame, in m.
        score: one vector: how the present state scores, in m; of a task of the kernel.
    """

    drive: int
    rhythm: Rhythm
    scene: Scene
    networks: Networks
    values: Reals
    servos: Servos
    streams: Integers
    draws: Reals
    noise: float
    delay: int
    memory: Reals
    blur: np.ndarray
    clock: np.ndarray
    failed_at: Integers
    head: Reals
    score: Reals


class Recording(NamedTuple):
    """Where to write down what happens. Arrays of length 0 are left out.

    Attributes:
        path: (seconds, lanes, 2) where the heads are in the frame at every full second, in m. A lane that
            has failed stays where it was before that.
        poses: (updates, trials, rods, 7) centres in m and quaternions after every control update, of the
            first lanes.
        commands: (updates, trials, modules x 5) commanded lengths in m, noise included.
        sensed: (updates, trials, inputs) what the networks were given.
        forces: (updates, trials, places x 6) of the ground on both ends of the rod at each place, in N.
    """

    path: np.ndarray
    poses: np.ndarray
    commands: np.ndarray
    sensed: np.ndarray
    forces: np.ndarray


NOTHING: Final[frozenset[str]] = frozenset()
"""What is recorded besides the path unless asked for."""
POSE: Final = 7
"""Numbers of a rod's pose: centre and quaternion, the first of its state."""


class HeadOf(Protocol):
    """What has to be known of a head; ``engine.simulation.rollout.Head`` says it."""

    @property
    def module(self) -> int:
        """Index of the head module."""

    @property
    def front(self) -> tuple[int, ...]:
        """Rods of the module whose centres average to its front face."""

    @property
    def rear(self) -> tuple[int, ...]:
        """Rods of the module whose centres average to its rear face."""

    @property
    def is_end(self) -> bool:
        """Whether it is the chain's last module."""


def make_recording(
    model: Model, loop: Loop, n_updates: int, record: frozenset[str], *, n_trials: int
) -> Recording:
    """Return room for the next control updates of the first lanes.

    Args:
        model: the robots.
        loop: what drives them.
        n_updates: how many control updates.
        record: which fields are wanted besides the path.
        n_trials: how many lanes.
    """
    rhythm = loop.rhythm
    since = int(loop.clock[0]) - rhythm.start
    seconds = (since + n_updates) // rhythm.per_second - since // rhythm.per_second
    sizes: dict[str, tuple[int, ...]] = {
        "poses": (RODS * model.n_modules, POSE),
        "commands": (INTERNAL * model.n_modules,),
        "sensed": (loop.networks.n_inputs,),
        "forces": (6 * RODS * model.n_modules,),
    }
    assert record <= set(sizes)
    arrays = {k: np.zeros((n_updates if k in record else 0, n_trials, *size)) for k, size in sizes.items()}
    return Recording(path=np.zeros((seconds, n_trials, 2)), **arrays)


def head_rods(head: HeadOf) -> list[int]:
    """Return the three rods of a head's front face, then those of its rear face."""
    return [RODS * head.module + rod for rod in (*head.front, *head.rear)]


def make_loop(
    model: Model,
    scene: Scene,
    physics: Physics,
    *,
    drive: int,
    start: int,
    heads: Sequence[HeadOf],
    controllers: Sequence[Controller] | None = None,
    noise: Sequence[tuple[int, int, int, int]] | None = None,
    blur: np.ndarray | None = None,
) -> Loop:
    """Return a loop that begins ``start`` control updates after the drop.

    Args:
        model: the robots.
        scene: what is sensed.
        physics: time step, control period and noise.
        drive: see ``Loop``.
        start: control updates.
        heads: per lane its robot's.
        controllers: per lane the one that drives it, if they do.
        noise: per lane its run's seed, its evaluation's number, its target and its repeat.
        blur: (inputs,) standard deviations of the noise on what is sensed, in the networks' units.
    """
    n, width = model.n_modules, len(heads)
    networks, pairs = no_networks(width), []
    if controllers is not None:
        of_lane = [(id(c), h.is_end) for c, h in zip(controllers, heads, strict=True)]
        firsts = [of_lane.index(k) for k in dict.fromkeys(of_lane)]
        lanes = np.array([[k == of_lane[first] for k in of_lane] for first in firsts])
        networks = compile_networks([controllers[k] for k in firsts], lanes, 2 * n)
        # the first pair of outputs drives the head module
        pairs = [range(n)[::-1] if heads[k].is_end else range(n) for k in firsts]
    built, period = physics.built, physics.control_period
    delay = round(built.sensing_delay / period)
    blur = np.empty(0) if blur is None or not blur.any() else blur
    return Loop(
        drive=drive,
        rhythm=Rhythm(physics.steps_per_control, period, round(1.0 / period), start),
        scene=scene,
        networks=networks,
        values=reals(networks.n_inputs + len(networks.bias), width=width),
        servos=make_servos(pairs, built, period, n_modules=n, width=width),
        streams=integers(4, width=width) if noise is None else streams(noise, width=width),
        draws=reals(INTERNAL * n + len(blur), width=width),
        noise=physics.servo_noise,
        delay=delay,
        memory=reals(delay * networks.n_inputs, width=width),
        blur=blur,
        clock=np.array([start]),
        failed_at=integers(1, width=width),
        head=reals(2, width=width),
        score=reals(1, width=width),
    )
