"""A small robot with trials of a built-in task, driven by the kernel."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.simulation.kernel.guard import read_robot
from engine.simulation.kernel.loop.dropped import Dropped
from engine.simulation.kernel.loop.trials import Start, Trials
from engine.simulation.kernel.robots.parameters import Robot
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head
from engine.tasks import GOAL_REACHING, Task, target_offsets, worlds
from tests.support.made_up import evolved_controller

PHYSICS = Physics()
MORPHOLOGY = Morphology((4, 8), (3, 6))
EVERYTHING = frozenset({"poses", "commands", "sensed", "forces"})


class Driven(NamedTuple):
    """What trials are made of."""

    morphology: Morphology
    numbers: Robot
    dropped: Dropped
    head: Head
    controller: Controller
    task: Task


def drop(*morphologies, width=8):
    robots = [build_robot(morphology, PHYSICS) for morphology in morphologies]
    return Dropped(
        [read_robot(robot) for robot in robots],
        np.array([robot.model.qpos0.reshape(-1, 7) for robot in robots]),
        ends=[Head.of(morphology, True) for morphology in morphologies],
        rhythms=[morphology.open_loop for morphology in morphologies],
        physics=PHYSICS,
        width=width,
    )


@functools.cache
def driven(task=GOAL_REACHING, is_end=True, morphology=MORPHOLOGY, width=8):
    """Return a settled robot, which nobody changes."""
    dropped = drop(morphology, width=width)
    dropped.settle(40)
    numbers = read_robot(build_robot(morphology, PHYSICS))
    controller = evolved_controller(6, 20, task.n_inputs)
    return Driven(morphology, numbers, dropped, Head.of(morphology, is_end), controller, task)


def trial_names(n, task):
    """Return what the noise of n trials is drawn for."""
    return [(11, 5, k % task.n_targets, k // task.n_targets) for k in range(n)]


def trials(robot, which=range(8), width=8, physics=PHYSICS, task=None):
    """Return a robot's trials by their numbers: number k is for target k modulo the number of targets."""
    return trials_of([robot] * len(which), which, width, physics, task or robot.task)


def trials_of(robots, which, width, physics, task):
    """Return trials of robots that have settled equally long, a robot and a number each."""
    target = [k % task.n_targets for k in which]
    names = trial_names(max(which) + 1, task)
    boxes = worlds(task, robots[0].numbers.n_modules)
    return Trials(
        [Start(r.numbers, r.dropped.state, 0, r.head, r.controller) for r in robots],
        n_updates=robots[0].dropped.n_updates,
        targets=target_offsets(task)[target],
        noise=[names[k] for k in which],
        task=task,
        physics=physics,
        walls=[boxes[t] for t in target],
        width=width,
    )


def all_bytes(trials, motion):
    """Return, trial by trial, everything that is known of it."""
    found = []
    for k in range(len(trials.scores)):
        parts = [motion.path[k], motion.poses[:, k], motion.commands[:, k], motion.sensed[:, k]]
        parts += [motion.forces[:, k]]
        parts += [trials.scores[k], trials.rods[k], trials.head[k], trials.failures[k]]
        found.append(b"".join(np.ascontiguousarray(p).tobytes() for p in parts))
    return found
