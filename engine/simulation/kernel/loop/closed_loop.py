"""The closed loop: sense, think, act, for as long as wanted without returning to Python.

One call moves simulations of robots of one size on, one per lane. A control update is

1. what the head senses (``sensing``), unless Python has filled it in, and what of it the network is told;
2. the network (``network``), unless the robot has settled only now or shows which end is its head;
3. every module's command (``servos``) and the noise on every internal cable (``noise``);
4. the time steps of the physics (``step``);
5. the judgement whether a simulation has diverged (``guard``), after which its lane stays as it is.

Everything that one call leaves to the next is in its arguments, so that a trial can be continued in pieces of
any size, past its end as well, with the same bits.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.simulation.kernel import guard
from engine.simulation.kernel.lanes.compiling import entry_point, inlined
from engine.simulation.kernel.lanes.simd import Reals, load, load_lane, select, splat, store
from engine.simulation.kernel.loop.network import activate
from engine.simulation.kernel.loop.noise import gaussians
from engine.simulation.kernel.loop.sensing import PYTHON, look, place, position, score, sense
from engine.simulation.kernel.loop.servos import choose, command, turn
from engine.simulation.kernel.loop.setup import CONTROLLER, POSE, RELEASED, Loop, Recording
from engine.simulation.kernel.physics.state import ROD, State
from engine.simulation.kernel.robots.model import Model
from engine.simulation.kernel.step import advance

SLACK: Final = 1.0
"""A commanded length in m at which an internal cable is slack: longer than a module."""


@inlined
def _write(vectors: Reals, first: int, n: int, lane: int, numbers: np.ndarray) -> None:
    for k in range(n):
        numbers[k] = load_lane(vectors, first + k, lane)


@inlined
def _record(state: State, loop: Loop, recording: Recording, k: int) -> None:
    """Write down control update k of a call."""
    if len(recording.poses):
        for lane in range(recording.poses.shape[1]):
            for rod in range(recording.poses.shape[2]):
                _write(state.rods, ROD * rod, POSE, lane, recording.poses[k, lane, rod])
    if len(recording.commands):
        for lane in range(recording.commands.shape[1]):
            _write(state.commanded, 0, recording.commands.shape[2], lane, recording.commands[k, lane])
    if len(recording.sensed):
        for lane in range(recording.sensed.shape[1]):
            _write(loop.values, 0, recording.sensed.shape[2], lane, recording.sensed[k, lane])
    if len(recording.forces):
        for lane in range(recording.forces.shape[1]):
            _write(state.contact_force, 0, recording.forces.shape[2], lane, recording.forces[k, lane])


@inlined
def _find_head(loop: Loop) -> None:
    """Bring ``loop.head`` up to date."""
    x, y = position(loop.scene)
    store(loop.head, 0, x)
    store(loop.head, 1, y)


@inlined
def _tell(loop: Loop) -> None:
    """Turn what is sensed into what the networks are told: late and with noise, where robots sense so."""
    n = loop.networks.n_inputs
    if loop.delay > 0:
        since = loop.clock[0] - loop.rhythm.start
        if since == 0:
            for k in range(loop.delay * n):
                store(loop.memory, k, load(loop.values, k % n))
        first = since % loop.delay * n
        for k in range(n):
            now = load(loop.values, k)
            store(loop.values, k, load(loop.memory, first + k))
            store(loop.memory, first + k, now)
    for k in range(len(loop.blur)):
        draw = load(loop.draws, len(loop.draws) - len(loop.blur) + k)
        store(loop.values, k, load(loop.values, k) + loop.blur[k] * draw)


@inlined
def _command(state: State, loop: Loop) -> None:
    """Set the commanded lengths of one control update."""
    if loop.drive == RELEASED:
        for k in range(len(state.commanded)):
            store(state.commanded, k, SLACK)
        return
    if loop.drive == CONTROLLER:
        gaussians(loop.streams, loop.clock[0], loop.draws)
        _tell(loop)
        activate(loop.networks, loop.values)
        choose(loop.servos, loop.networks, loop.values)
    turn(loop.servos, loop.clock[0] * loop.rhythm.period)
    command(loop.servos, state.commanded)
    if loop.drive == CONTROLLER:
        for k in range(len(state.commanded)):
            store(state.commanded, k, load(state.commanded, k) + load(loop.draws, k) * loop.noise)


@inlined
def _judge(model: Model, state: State, loop: Loop) -> None:
    """Count a control update, stop what has diverged and look where the heads of the others are."""
    guard.judge(model, state)
    loop.clock[0] += 1
    failed, before = load(state.failed, 0), load(loop.failed_at, 0)
    new = (failed != 0) & (before == 0)
    store(loop.failed_at, 0, select(new, splat(before, loop.clock[0]), before))
    look(state.rods, state.failed, loop.scene)


@entry_point
def begin(state: State, loop: Loop) -> None:
    """Lay the head's frame where it is now, and put up targets and walls in it."""
    look(state.rods, state.failed, loop.scene)
    place(loop.scene, state.walls)
    failed = load(state.failed, 0)
    store(loop.failed_at, 0, select(failed != 0, splat(failed, loop.clock[0]), 0))
    _find_head(loop)


@entry_point
def run(model: Model, state: State, loop: Loop, recording: Recording, n_updates: int) -> None:
    """Move simulations on.

    Args:
        model: the robots.
        state: the simulations.
        loop: what drives them. If their task is Python's, the networks' inputs are in ``loop.values`` and
            ``n_updates`` is 1.
        recording: for the full seconds and the control updates of this call.
        n_updates: how many control updates.
    """
    in_kernel = loop.drive == CONTROLLER and loop.scene.kind != PYTHON
    second = 0
    for k in range(n_updates):
        if in_kernel:
            sense(loop.scene, loop.values)
        _command(state, loop)
        advance(model, state, loop.rhythm.n_steps)
        _judge(model, state, loop)
        _record(state, loop, recording, k)
        if (loop.clock[0] - loop.rhythm.start) % loop.rhythm.per_second == 0:
            if second < len(recording.path):
                _find_head(loop)
                for lane in range(recording.path.shape[1]):
                    _write(loop.head, 0, 2, lane, recording.path[second, lane])
            second += 1
    _find_head(loop)
    if in_kernel:
        score(loop.scene, loop.score)
