"""Friction of feet that grip one way, such as bristles and scales: small forward, large backward.

Forward is along the chain at a rod's module, on the ground: from the centre of the module before it to that
of the module after it, and from or to its own centre at an end of the chain. A contact with the ground that
slides that way faster than ``Model.feet_hold`` before a step has the forward coefficient of friction in this
step; one that slides backward or across, or is still, has the backward one. docs/feet.md says why.
"""

from __future__ import annotations

from engine.simulation.kernel.lanes.algebra import Point, add, dot, load3, scale, sub, zero3
from engine.simulation.kernel.lanes.compiling import compiled, inlined
from engine.simulation.kernel.lanes.simd import Real, Reals, load, maximum, select, splat, square_root
from engine.simulation.kernel.physics.friction import TINY
from engine.simulation.kernel.physics.state import ROD, State
from engine.simulation.kernel.robots.model import Model, store3_of
from engine.simulation.kernel.robots.parameters import RODS


@compiled
def find_forward(model: Model, state: State) -> None:
    """Find which way on the ground is forward for each rod."""
    forward, zero, which = state.work.forward, splat(state.rods, 0.0), load(model.feet, 0)
    last = model.n_modules - 1
    for m in range(model.n_modules):
        along = sub(_sum_of_rods(state.rods, min(m + 1, last)), _sum_of_rods(state.rods, max(m - 1, 0)))
        size = square_root(maximum(along[0] * along[0] + along[1] * along[1], TINY))
        along = scale((along[0], along[1], zero), which / size)
        for r in range(RODS):
            store3_of(model, forward, 3, RODS * m + r, 0, along)


@inlined
def _sum_of_rods(rods: Reals, m: int) -> Point:
    """Return six times the centre of a module."""
    total = zero3(rods)
    for r in range(RODS):
        total = add(total, load3(rods, ROD * (RODS * m + r)))
    return total


@inlined
def friction_at(model: Model, state: State, k: int, velocity: Point) -> Real:
    """Return the coefficient of friction with the ground of the rod at place k.

    Args:
        model: the robot.
        state: the simulations.
        k: the place.
        velocity: of the contact's point before the step, in m/s.
    """
    friction = splat(state.rods, model.friction)
    if model.n_footed:
        slides = dot(velocity, load3(state.work.forward, 3 * k)) > model.feet_hold
        feet = select(slides, splat(state.rods, model.feet_forward), splat(state.rods, model.feet_backward))
        friction = select(load(model.feet, 0) != 0.0, feet, friction)
    return friction
