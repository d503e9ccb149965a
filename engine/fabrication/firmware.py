"""The robot's controller as an Arduino sketch.

A microcontroller gets what the simulation computes at every control update: the network, the choice of a
frequency and a phase for each module, and the servo command that follows from them and the time. How a real
robot senses its target is left open: the sketch calls functions that its owner fills in. Without them every
module keeps a fixed rhythm.

The templates are in ``engine/data/firmware``; ``@name@`` stands for a value.
"""

from __future__ import annotations

import importlib.resources
import re
import textwrap
from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from engine.body import module as t
from engine.body import servo
from engine.config import RunConfig, task_of
from engine.control.network import Plan
from engine.replay.replay import repeat_trial
from engine.simulation.evaluation import Evaluation
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head
from engine.simulation.trials import driving
from engine.tasks import sensed
from engine.tasks.squeezing import SENSOR_RANGE

SKETCH: Final = "tsmr_robot"
"""Folder and file name of the sketch; the Arduino IDE wants them equal."""
CYCLE: Final = 4.0
"""Common period in seconds of all ``servo.FREQUENCIES``."""
FIRST_PIN: Final = 2
"""Pin of the first module; 0 and 1 carry the serial line."""
RELEASED_PULSE: Final = 1000
CONTRACTED_PULSE: Final = 2000
"""Pulse widths in microseconds that are safe for servos; the arm's position at them must be measured."""
_TASKS: Final = ("goal-reaching", "squeezing")
"""Tasks with a function for each sensor; for other tasks the owner fills in all inputs at once."""


def pin_map(n_modules: int) -> dict[int, int]:
    """Return the pin that the sketch assumes for the servo of each module, by the module's index."""
    return {module: FIRST_PIN + module for module in range(n_modules)}


def firmware_files(
    config: RunConfig, evaluation: Evaluation, *, run: str, first: np.ndarray | None = None
) -> dict[str, bytes]:
    """Return the sketch that drives a robot as its controller did in simulation.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: of the robot.
        run: name of the run, for the comments.
        first: (inputs,) with which its first trial began; None to simulate settling again and sense them.

    Returns:
        Content by name; the names lie in the folder ``tsmr_robot``, which the Arduino IDE opens.

    Raises:
        InvalidData: today's robots do not survive the run's physics, or their cycle is no whole number of
            control updates.
    """
    first = start_inputs(config, evaluation) if first is None else first
    values = _values(config, evaluation, run, first)
    files = {
        f"{SKETCH}/{SKETCH}.ino": "robot.ino",
        f"{SKETCH}/controller.h": "controller.h",
        f"{SKETCH}/settings.h": "settings.h",
        f"{SKETCH}/sensing.h": "sensing.h",
    }
    return {name: fill_in(_data(template), values).encode() for name, template in files.items()}


def fill_in(template: str, values: Mapping[str, object]) -> str:
    """Return a template with every ``@name@`` replaced by a value.

    Raises:
        KeyError: there is no such value.
    """
    return re.sub(r"@(\w+)@", lambda m: str(values[m[1]]), template)


def start_inputs(config: RunConfig, evaluation: Evaluation) -> np.ndarray:
    """Return what the controller senses as the first trial begins, (inputs,)."""
    loop = repeat_trial(config, evaluation, target=0, repeat=0)
    return sensed(task_of(config), loop.view(), loop.sim.alive)[0, 0]


def _values(config: RunConfig, evaluation: Evaluation, run: str, first: np.ndarray) -> dict[str, object]:
    """Return the values of the templates' names."""
    solution, task, physics = evaluation.solution, task_of(config), config.physics
    n = solution.morphology.n_modules
    head = Head.of(solution.morphology, evaluation.head_is_end)
    rate = round(1.0 / physics.control_period)
    own_functions = task.name if task.name in _TASKS and not task.file else "other"
    return {
        "number": solution.number,
        "run": _comment(run),
        "task": task.name,
        "modules": n,
        "inputs": task.n_inputs,
        "head": t.module_number(head.module),
        "head_is_last": "true" if head.is_end else "false",
        "end": "last" if head.is_end else "first",
        "rate": rate,
        "budget": round(500.0 / rate),
        "settle_s": f"{config.trials.settle_time:g}",
        **_clock(physics, config.trials.settle_time),
        "n_frequencies": len(servo.FREQUENCIES),
        "frequencies": _numbers(servo.FREQUENCIES),
        "n_phases": len(servo.PHASES),
        "phases": _numbers(servo.PHASES),
        "input_names": "\n".join(f"//   {i}: {_comment(name)}" for i, name in enumerate(task.inputs)),
        "start_inputs": _numbers(first, 7),
        "target": _comment(task.target_names[0]),
        **_network(Plan(driving(solution.controller, config.trials), 2 * n), task.n_inputs),
        "n_cables": len(t.SERVO_NODES),
        "servo_nodes": ", ".join(map(str, t.SERVO_NODES)),
        "lengths": "\n".join(f"    {{{_numbers(1000.0 * row, 7)}}}," for row in servo.TARGET_LENGTHS),
        "servos": "\n".join(
            f"    {{{pin}, {RELEASED_PULSE}, {CONTRACTED_PULSE}}},  // module {t.module_number(module)}"
            f"{', the head' if module == head.module else ''}"
            for module, pin in pin_map(n).items()
        ),
        "functions": fill_in(
            _data(f"sensing_{own_functions.replace('-', '_')}.h"),
            {
                "range": _number(SENSOR_RANGE),
                "names": "\n".join(
                    f"//   inputs[{i}]: {_comment(s)}" + (f", times {unit:g}" if unit != 1.0 else "")
                    for i, (s, unit) in enumerate(zip(task.inputs, task.units, strict=True))
                ),
                "task": task.name,
                **{
                    f"unit_{i}": "" if unit == 1.0 else f"tsmr::real({_number(unit)}) * "
                    for i, unit in enumerate(task.units)
                },
            },
        ).rstrip(),
    }


def _clock(physics: Physics, settle_time: float) -> dict[str, int]:
    """Return the length of a control update in us, and of a cycle and of settling in updates."""
    return {
        "period_us": round(1e6 * physics.control_period),
        "cycle": round(CYCLE / physics.control_period),
        "settle": round(settle_time / physics.control_period),
    }


def _network(plan: Plan, n_inputs: int) -> dict[str, object]:
    """Return a network as lists of links, node by node."""
    sources, weights = plan.source.tolist(), plan.weight.tolist()
    n_sources = n_inputs + len(plan.hidden)
    return {
        "hidden": len(plan.hidden),
        "node_links": _wrapped(", ".join(map(str, plan.first.tolist()))),
        "node_bias": _wrapped(_numbers(plan.bias)),
        "source_type": "uint8_t" if n_sources <= 256 else "uint16_t",
        # an array of C++ must not be empty; nothing refers to this link
        "link_source": _wrapped(", ".join(map(str, sources or [0]))),
        "link_weight": _wrapped(_numbers(weights or [0.0])),
    }


def _numbers(values: Iterable[float], digits: int | None = None) -> str:
    return ", ".join(_number(v, digits) for v in values)


def _number(value: float, digits: int | None = None) -> str:
    """Return a number as C++ reads it back, to the last bit unless fewer digits are asked for."""
    text = repr(float(value)) if digits is None else f"{value:.{digits}g}"
    return text if re.search(r"[.e]", text) else f"{text}.0"


def _wrapped(numbers: str) -> str:
    """Return numbers as indented lines between the braces that surround them."""
    return "\n" + textwrap.fill(numbers, 100, initial_indent="    ", subsequent_indent="    ")


def _comment(text: str) -> str:
    """Return a text in one line that cannot end or continue a comment of C++."""
    return (
        " ".join(text.split()).replace("\\", "/").replace("*/", "* /").replace("??", "? ?").replace("@", "at")
    )


def _data(name: str) -> str:
    return (importlib.resources.files("engine") / "data" / "firmware" / name).read_text(encoding="utf-8")
