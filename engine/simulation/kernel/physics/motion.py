"""How rods move without contacts and links, and how they are moved on.

A step is MuJoCo's: semi-implicit Euler, with the forces that positions and velocities before it give.
"""

from __future__ import annotations

from typing import Final

from engine.simulation.kernel.lanes.algebra import (
    Point,
    add,
    cross,
    dot,
    load3,
    rotate,
    rotation_columns,
    scale,
    select3,
    store3,
    sub,
    zero3,
)
from engine.simulation.kernel.lanes.compiling import compiled, inlined
from engine.simulation.kernel.lanes.simd import (
    Real,
    load,
    maximum,
    minimum,
    select,
    splat,
    square_root,
    store,
)
from engine.simulation.kernel.physics.state import ACCELERATION, POSE, ROD, State
from engine.simulation.kernel.robots.model import Model, load3_of, store3_of
from engine.simulation.kernel.robots.parameters import CABLES, INTERNAL, PASSIVE, RODS

TURNED: Final = 18
"""Numbers of a rod in ``Work.module``: the columns of its rotation 9, angular velocity in the world's axes 3,
force on it 3 and its moment about the rod's middle 3."""


@compiled
def free_motion(model: Model, state: State) -> None:
    """Find every rod's pose and its acceleration without contacts and links."""
    rods, commanded, pose = state.rods, state.commanded, state.work.pose
    acceleration, turned = state.work.acceleration, state.work.module
    cable_rods, anchors, stiffness = model.cable_rods, model.cable_anchors, model.stiffness
    axis, spin = model.axis, model.spin
    inverse_mass, inverse_inertia = model.inverse_mass, model.inverse_inertia
    inverse_spin = model.inverse_spin
    for m in range(model.n_modules):
        for r in range(RODS):
            rod, t = ROD * (RODS * m + r), TURNED * r
            columns = _columns(rods, rod)
            store3(turned, t, columns[0])
            store3(turned, t + 3, columns[1])
            store3(turned, t + 6, columns[2])
            store3(turned, t + 9, rotate(columns, load3(rods, rod + 10)))
            store3(turned, t + 12, zero3(rods))
            store3(turned, t + 15, zero3(rods))
        for c in range(CABLES):
            a, b = cable_rods[2 * c], cable_rods[2 * c + 1]
            ta, tb = TURNED * a, TURNED * b
            rod_a, rod_b = ROD * (RODS * m + a), ROD * (RODS * m + b)
            k = 6 * c
            arm_a = _turned(turned, ta, anchors[k], anchors[k + 1], anchors[k + 2])
            arm_b = _turned(turned, tb, anchors[k + 3], anchors[k + 4], anchors[k + 5])
            along = add(sub(load3(rods, rod_b), load3(rods, rod_a)), sub(arm_b, arm_a))
            length = square_root(dot(along, along))
            along = scale(along, 1.0 / length)
            # a unit force along the cable turns the rods by these moments
            turn_a, turn_b = cross(arm_a, along), cross(arm_b, along)
            speed = (
                dot(sub(load3(rods, rod_b + 7), load3(rods, rod_a + 7)), along)
                + dot(load3(turned, tb + 9), turn_b)
                - dot(load3(turned, ta + 9), turn_a)
            )
            if c < PASSIVE:
                stretch = maximum(length - model.cable_rest, 0.0)
                push = -(load(stiffness, m) * stretch) - model.cable_damping * speed
            else:
                command = load(commanded, INTERNAL * m + c - PASSIVE)
                push = model.servo_gain * (command - length) - model.servo_offset
                push = push - model.servo_damping * speed
                push = minimum(maximum(push, -model.servo_limit), 0.0)
            force = scale(along, push)
            store3(turned, tb + 12, add(load3(turned, tb + 12), force))
            store3(turned, ta + 12, sub(load3(turned, ta + 12), force))
            store3(turned, tb + 15, add(load3(turned, tb + 15), scale(turn_b, push)))
            store3(turned, ta + 15, sub(load3(turned, ta + 15), scale(turn_a, push)))
        for r in range(RODS):
            k, t = RODS * m + r, TURNED * r
            e, w = load3(turned, t + 3 * axis[r]), load3(turned, t + 9)
            force, moment = load3(turned, t + 12), load3(turned, t + 15)
            middle = zero3(rods)
            if r == 0:
                x, y, z = model.centre_of_mass
                middle = _turned(turned, t, x, y, z)
                moment = sub(moment, cross(middle, force))
            # the angular momentum is not along the angular velocity
            moment = sub(moment, scale(cross(w, e), spin[r] * dot(e, w)))
            linear = scale(force, inverse_mass[r])
            linear = (linear[0], linear[1], linear[2] - model.gravity)
            angular = add(scale(moment, inverse_inertia[r]), scale(e, inverse_spin[r] * dot(e, moment)))
            if r == 0:
                linear = sub(linear, cross(w, cross(w, middle)))
            # adding 0 turns -0 into 0, so that later a constraint that is slack adds exactly nothing
            zero = zero3(rods)
            store3_of(model, acceleration, ACCELERATION, k, 0, add(linear, zero))
            store3_of(model, acceleration, ACCELERATION, k, 3, add(angular, zero))
            store3_of(model, pose, POSE, k, 0, e)
            store3_of(model, pose, POSE, k, 3, middle)
            store3_of(model, pose, POSE, k, 6, w)
            store3_of(model, pose, POSE, k, 9, load3(rods, ROD * k))
            store3_of(model, pose, POSE, k, 12, load3(rods, ROD * k + 7))


@inlined
def _columns(rods: object, rod: int) -> tuple[Point, Point, Point]:
    """Return the columns of a rod's rotation."""
    return rotation_columns(
        (load(rods, rod + 3), load(rods, rod + 4), load(rods, rod + 5), load(rods, rod + 6))
    )


@inlined
def _turned(turned: object, t: int, x: float, y: float, z: float) -> Point:
    """Return a point of a rod, from its middle, in the world's axes."""
    return rotate((load3(turned, t), load3(turned, t + 3), load3(turned, t + 6)), (x, y, z))


@compiled
def integrate(model: Model, state: State) -> None:
    """Move the rods of all simulations that go on by one time step."""
    rods, pose, acceleration = state.rods, state.work.pose, state.work.acceleration
    h, half = model.timestep, model.half_length
    goes_on = load(state.failed, 0) == 0
    fastest = splat(rods, 0.0)
    for k in range(RODS * model.n_modules):
        rod = ROD * k
        linear = load3_of(model, acceleration, ACCELERATION, k, 0)
        angular = load3_of(model, acceleration, ACCELERATION, k, 3)
        if k % RODS == 0:
            # from the centre of mass to the middle, whose motion the state describes
            linear = sub(linear, cross(angular, load3_of(model, pose, POSE, k, 3)))
        columns = _columns(rods, rod)
        v, w = load3(rods, rod + 7), load3(rods, rod + 10)
        own = (dot(columns[0], angular), dot(columns[1], angular), dot(columns[2], angular))
        v = select3(goes_on, add(v, scale(linear, h)), v)
        w = select3(goes_on, add(w, scale(own, h)), w)
        # the square of the sum of two speeds is at most twice the sum of their squares
        fastest = maximum(2.0 * (dot(v, v) + half * half * dot(w, w)), fastest)
        store3(rods, rod + 7, v)
        store3(rods, rod + 10, w)
        x = load3(rods, rod)
        store3(rods, rod, select3(goes_on, add(x, scale(v, h)), x))
        before = (load(rods, rod + 3), load(rods, rod + 4), load(rods, rod + 5), load(rods, rod + 6))
        after = _turned_on(before, w, h)
        store(rods, rod + 3, select(goes_on, after[0], before[0]))
        store(rods, rod + 4, select(goes_on, after[1], before[1]))
        store(rods, rod + 5, select(goes_on, after[2], before[2]))
        store(rods, rod + 6, select(goes_on, after[3], before[3]))
    moved = state.work.moved
    store(moved, 0, load(moved, 0) + select(goes_on, h * square_root(fastest), 0.0))


@inlined
def _turned_on(q: tuple[Real, Real, Real, Real], w: Point, h: float) -> tuple[Real, Real, Real, Real]:
    """Return a quaternion turned for a time h in s at an angular velocity w in rad/s in its own frame.

    Sine and cosine of half the angle are their Taylor series to the 11th power: within 2e-17 up to half an
    angle of 0.3, 240 rad/s at the default time step, where a healthy rod's fastest is some 30. The
    square root that would make the quaternion one of length 1 again is replaced by its tangent.
    """
    y = dot(w, w) * (0.25 * h * h)
    cosine = 1.0 + y * (-1 / 2 + y * (1 / 24 + y * (-1 / 720 + y * (1 / 40320 + y * (-1 / 3628800)))))
    ratio = 1.0 + y * (-1 / 6 + y * (1 / 120 + y * (-1 / 5040 + y * (1 / 362880 + y * (-1 / 39916800)))))
    x, y, z = scale(w, 0.5 * h * ratio)
    q0 = q[0] * cosine - q[1] * x - q[2] * y - q[3] * z
    q1 = q[0] * x + q[1] * cosine + q[2] * z - q[3] * y
    q2 = q[0] * y - q[1] * z + q[2] * cosine + q[3] * x
    q3 = q[0] * z + q[1] * y - q[2] * x + q[3] * cosine
    length = 1.5 - 0.5 * (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    return q0 * length, q1 * length, q2 * length, q3 * length
