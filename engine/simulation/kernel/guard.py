"""Tells simulations that have diverged from healthy ones, after every control update.

The limits are those of ``engine.simulation.divergence``, which judges MuJoCo's simulations.
"""

from __future__ import annotations

from typing import Final

from engine.simulation.divergence import ARENA_RADIUS, speed_limit
from engine.simulation.kernel.lanes.algebra import dot, load3
from engine.simulation.kernel.lanes.bare import bare
from engine.simulation.kernel.lanes.compiling import compiled
from engine.simulation.kernel.lanes.simd import absolute, load, maximum, select, splat, store, to_integer
from engine.simulation.kernel.physics.state import ROD, State
from engine.simulation.kernel.robots.model import Model
from engine.simulation.kernel.robots.parameters import INTERNAL, RODS, Robot, read_model
from engine.simulation.model import RobotModel

GOES_ON: Final = 0
NOT_FINITE: Final = 1
OUTSIDE: Final = 2
TOO_FAST: Final = 3
COMMAND: Final = 4


def read_robot(robot: RobotModel) -> Robot:
    """Read a robot's numbers, with the speed that no rod of it can reach.

    Raises:
        ValueError: its model has something that the kernel does not know; says what.
    """
    forward, backward = robot.feet_friction
    return read_model(robot.model)._replace(
        feet=float(robot.feet),
        feet_forward=forward,
        feet_backward=backward,
        speed_limit=speed_limit(robot),
        arena_radius=ARENA_RADIUS,
    )


def reason(code: int, robot: Robot) -> str:
    """Say what a code other than ``GOES_ON`` means."""
    return {
        COMMAND: "a control was not finite",
        NOT_FINITE: "the state is not finite",
        OUTSIDE: f"a rod is more than {ARENA_RADIUS:g} m from the origin, outside the arena",
        TOO_FAST: f"a rod moves faster than {robot.speed_limit:.1f} m/s, which is impossible",
    }[code]


@compiled
def judge(model: Model, state: State) -> None:
    """Set ``state.failed`` in the lanes of simulations that have diverged since it was last asked."""
    _judge(bare(model), bare(state))


@compiled
def _judge(model: Model, state: State) -> None:
    rods, failed = state.rods, state.failed
    size, reach, fastest = splat(rods, 0.0), splat(rods, 0.0), splat(rods, 0.0)
    for k in range(RODS * model.n_modules):
        for i in range(ROD):
            x = load(rods, ROD * k + i)
            size = size + x * x
            if i < 3:
                reach = maximum(absolute(x), reach)
        velocity = load3(rods, ROD * k + 7)
        fastest = maximum(dot(velocity, velocity), fastest)
    # a sum of squares is finite only if everything in it is; what is not a number compares as false
    limit = load(model.speed_limit, 0)
    code = select(fastest <= limit * limit, 0.0, 1.0 * TOO_FAST)
    code = select(reach < model.arena_radius, code, 1.0 * OUTSIDE)
    code = select(size - size == 0.0, code, 1.0 * NOT_FINITE)
    control = splat(rods, 0.0)
    for i in range(INTERNAL * model.n_modules):
        control = control + absolute(load(state.commanded, i))
    code = select(control - control == 0.0, code, 1.0 * COMMAND)
    before = load(failed, 0)
    store(failed, 0, select(before == 0, to_integer(code), before))
