"""Links between rods of neighbouring modules: a length between two limits, held softly beyond.

A link is a line of ``Work.link``, of the island with the same number: unit vector 3 from the first rod's end
to the second's, or back where the link is too long; moments of a unit force along it on the two rods 6 and
the angular accelerations that these give 6; softness; the acceleration that it seeks; 1 / (acceleration per
force), 0 in lanes where it is slack; force.
"""

from __future__ import annotations

from engine.simulation.kernel.lanes.algebra import add, cross, dot, load3, scale, store3, sub
from engine.simulation.kernel.lanes.compiling import compiled, inlined
from engine.simulation.kernel.lanes.simd import (
    Mask,
    Real,
    Reals,
    any_lane,
    load,
    maximum,
    select,
    square_root,
    store,
)
from engine.simulation.kernel.physics.contact import turned_by
from engine.simulation.kernel.physics.softness import impedance
from engine.simulation.kernel.physics.state import LINK, POSE, State
from engine.simulation.kernel.robots.model import Model


@compiled
def find_links(model: Model, state: State) -> None:
    """Find which links are too long or too short."""
    pose, link = state.work.pose, state.work.link
    force, linked = state.link_force, state.work.linked
    simulated = load(state.failed, 0) == 0
    shortest, longest = model.link_range
    least, most, width = model.link_impedance
    for i in range(model.n_links):
        a, b = 2 * i, 2 * i + 1
        linked[i] = 0
        axis_a, axis_b = load3(pose, POSE * a), load3(pose, POSE * b)
        arm_a, arm_b = scale(axis_a, load(model.link_arms, a)), scale(axis_b, load(model.link_arms, b))
        between = add(sub(load3(pose, POSE * b + 9), load3(pose, POSE * a + 9)), sub(arm_b, arm_a))
        length = square_root(dot(between, between))
        long, short = length > longest, length < shortest
        there = (long | short) & simulated
        if not any_lane(there):
            store(force, i, 0.0)
            continue
        linked[i] = 1
        one = 1.0 / length
        along = scale(between, select(long, -one, one))
        depth = select(long, longest - length, length - shortest)
        speed = (
            dot(sub(load3(pose, POSE * b + 12), load3(pose, POSE * a + 12)), along)
            + dot(load3(pose, POSE * b + 6), cross(arm_b, along))
            - dot(load3(pose, POSE * a + 6), cross(arm_a, along))
        )
        turn_a = cross(sub(arm_a, load3(pose, POSE * a + 3)), along)
        turn_b = cross(sub(arm_b, load3(pose, POSE * b + 3)), along)
        angular_a = turned_by(turn_a, axis_a, load(model.place_inertia, a), load(model.place_spin, a))
        angular_b = turned_by(turn_b, axis_b, load(model.place_inertia, b), load(model.place_spin, b))
        hard = impedance(depth, least, most, width)
        soft = (1.0 - hard) * load(model.link_weight, i) / hard
        response = (load(model.place_mass, a) + load(model.place_mass, b)) + soft
        response = response + dot(turn_a, angular_a) + dot(turn_b, angular_b)
        c = LINK * i
        store3(link, c, along)
        store3(link, c + 3, turn_a)
        store3(link, c + 6, turn_b)
        store3(link, c + 9, angular_a)
        store3(link, c + 12, angular_b)
        store(link, c + 15, soft)
        store(link, c + 16, -(model.link_damping * speed) - model.link_stiffness * hard * depth)
        store(link, c + 17, select(there, 1.0 / response, 0.0))
        store(link, c + 18, select(there, load(force, i), 0.0))


@inlined
def relax_link(link: Reals, c: int, acceleration: Reals, a: int, b: int, goes_on: Mask, over: float) -> Real:
    """Give a link, which only pushes or pulls, the best force while all others stay; return its change.

    Args:
        link: all links.
        c: where this one begins.
        acceleration: of rods.
        a: where that of its first rod begins.
        b: where that of its second rod begins.
        goes_on: lanes whose force may change.
        over: how much further than it seeks the force is moved.
    """
    f = load(link, c + 18)
    linear = sub(load3(acceleration, b), load3(acceleration, a))
    residual = dot(load3(link, c), linear) + (
        dot(load3(link, c + 6), load3(acceleration, b + 3))
        - dot(load3(link, c + 3), load3(acceleration, a + 3))
    )
    residual = residual - load(link, c + 16) + load(link, c + 15) * f
    new = select(goes_on, maximum(f - residual * load(link, c + 17) * over, 0.0), f)
    store(link, c + 18, new)
    return new - f


@inlined
def push_linked(
    link: Reals, c: int, acceleration: Reals, a: int, b: int, force: Real, mass_a: Real, mass_b: Real
) -> None:
    """Add to the accelerations of a link's rods, of inverse masses mass_a and mass_b, what a force does."""
    along = load3(link, c)
    store3(acceleration, a, sub(load3(acceleration, a), scale(along, force * mass_a)))
    store3(acceleration, b, add(load3(acceleration, b), scale(along, force * mass_b)))
    store3(acceleration, a + 3, sub(load3(acceleration, a + 3), scale(load3(link, c + 9), force)))
    store3(acceleration, b + 3, add(load3(acceleration, b + 3), scale(load3(link, c + 12), force)))
