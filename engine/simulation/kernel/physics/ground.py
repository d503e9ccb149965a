"""Where the ends of rods touch the ground, the plane z = 0."""

from __future__ import annotations

from engine.simulation.kernel.lanes.algebra import add, cross, load3, scale, store3, store6, sub, zero3
from engine.simulation.kernel.lanes.compiling import compiled
from engine.simulation.kernel.lanes.simd import any_lane, load, splat, square_root, store
from engine.simulation.kernel.physics.contact import store_inverse, where_there
from engine.simulation.kernel.physics.feet import friction_at
from engine.simulation.kernel.physics.softness import impedance, plus_rod
from engine.simulation.kernel.physics.state import CONTACT, POSE, State
from engine.simulation.kernel.robots.model import Model


@compiled
def touch_ground(model: Model, state: State, k: int, n: int) -> int:
    """List the contacts of the rod at place k with the ground, after n others; return how many there are."""
    pose, contact, force = state.work.pose, state.work.contact, state.contact_force
    z = load(pose, POSE * k + 11)
    e, middle, w = load3(pose, POSE * k), load3(pose, POSE * k + 3), load3(pose, POSE * k + 6)
    simulated = load(state.failed, 0) == 0
    for end in range(2):
        slot = 2 * k + end
        arm = model.half_length if end == 0 else -model.half_length
        depth = z + arm * e[2] - model.radius
        there = (depth <= 0.0) & simulated
        if not any_lane(there):
            store3(force, 3 * slot, zero3(force))
            continue
        # MuJoCo's contact point: halfway between the lowest point of the rod's end and the ground
        r = scale(e, arm)
        r = (r[0], r[1], r[2] - (0.5 * depth + model.radius))
        velocity = add(load3(pose, POSE * k + 12), cross(w, r))
        r = sub(r, middle)
        least, most, width = model.contact_impedance
        hard = impedance(depth, least, most, width)
        soft = (1.0 - hard) * load(model.place_weight, k) / hard
        across, zero = soft * (1.0 / model.impratio), splat(force, 0.0)
        response = plus_rod(
            (across, zero, zero, across, zero, soft),
            e,
            r,
            load(model.place_mass, k),
            load(model.place_inertia, k),
            load(model.place_spin, k),
        )
        sought = scale(velocity, -model.contact_damping)
        sought = (sought[0], sought[1], sought[2] - model.contact_stiffness * hard * depth)
        mean, part = 0.5 * (response[0] + response[3]), 0.5 * (response[0] - response[3])
        c = CONTACT * n
        store3(contact, c, r)
        store3(contact, c + 3, sought)
        store3(contact, c + 6, where_there(there, force, 3 * slot))
        store6(contact, c + 9, response)
        store_inverse(contact, c + 15, there, response)
        store(contact, c + 21, soft)
        store(contact, c + 22, mean + square_root(part * part + response[1] * response[1]))
        store(contact, c + 26, friction_at(model, state, k, velocity))
        state.work.contact_slot[n] = slot
        n += 1
    return n
