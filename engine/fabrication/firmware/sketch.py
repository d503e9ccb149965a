"""The files of the sketch that drives a robot."""

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
from engine.errors import InvalidData
from engine.fabrication.firmware import protocol
from engine.fabrication.firmware.gaits import RecordedGait, best_of, fitting, recorded_gaits
from engine.simulation.evaluation import Evaluation
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head
from engine.simulation.trials import driving
from engine.tasks import Task

SKETCH: Final = "tsmr_robot"
"""Folder and file name of the sketch; the Arduino IDE wants them equal."""
CYCLE: Final = 4.0
"""Common period in seconds of all ``servo.FREQUENCIES``."""
FIRST_PIN: Final = 2
"""Pin of the first module; 0 and 1 carry the serial line."""
RELEASED_PULSE: Final = 1000
CONTRACTED_PULSE: Final = 2000
"""Pulse widths in microseconds that are safe for servos; the arm's position at them must be measured."""
SHORTEST_PULSE: Final = 500
LONGEST_PULSE: Final = 2500
"""Pulse widths in microseconds that a servo of this kind bears, and Arduino's library is to send."""
START_PIN: Final = 12
_ESP32_PINS: Final = (13, 14, 16, 17, 18, 19, 21, 22, 23, 25)
"""Pins of an ESP32 development board that carry a servo's signal and do not decide how it starts."""


def pin_map(n_modules: int) -> dict[int, int]:
    """Return the pin that the sketch assumes for the servo of each module, by the module's index."""
    return {module: FIRST_PIN + module for module in range(n_modules)}


def firmware_files(
    config: RunConfig, evaluation: Evaluation, *, run: str, as_built: Physics | None = None
) -> dict[str, bytes]:
    """Return the sketch that drives a robot as its controller did in simulation.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: of the robot.
        run: name of the run, for the comments.
        as_built: physics of the robot as it would be built, to record its gaits with; the run's own where it
            is None or the robot does not survive it.

    Returns:
        Content by name; the names lie in the folder ``tsmr_robot``, which the Arduino IDE opens.

    Raises:
        InvalidData: today's robots do not survive the run's physics, or their cycle is no whole number of
            control updates.
    """
    try:
        gaits = recorded_gaits(config, evaluation, as_built or config.physics)
    except InvalidData:
        if as_built is None:
            raise
        as_built, gaits = None, recorded_gaits(config, evaluation, config.physics)
    values = _values(config, evaluation, run) | _gaits(gaits, task_of(config), config.physics)
    values["as_built"] = "" if as_built is None else ", as it would be built,"
    files = {f"{SKETCH}/{SKETCH}.ino": "robot.ino"}
    files |= {f"{SKETCH}/{name}": name for name in ("controller.h", "gaits.h", "protocol.h", "settings.h")}
    return {name: fill_in(_data(template), values).encode() for name, template in files.items()}


def fill_in(template: str, values: Mapping[str, object]) -> str:
    """Return a template with every ``@name@`` replaced by a value.

    Raises:
        KeyError: there is no such value.
    """
    return re.sub(r"@(\w+)@", lambda m: str(values[m[1]]), template)


def _values(config: RunConfig, evaluation: Evaluation, run: str) -> dict[str, object]:
    """Return the values of the templates' names, but for the gaits'."""
    solution, task, physics = evaluation.solution, task_of(config), config.physics
    n = solution.morphology.n_modules
    head = Head.of(solution.morphology, evaluation.head_is_end)
    return {
        "number": solution.number,
        "run": _comment(run),
        "task": task.name,
        "modules": n,
        "inputs": task.n_inputs,
        "head": t.module_number(head.module),
        "head_is_last": "true" if head.is_end else "false",
        "rate": round(1.0 / physics.control_period),
        "rate_least": protocol.LEAST_RATE,
        "patience_ms": round(1000 * protocol.PATIENCE),
        "settle_s": f"{config.trials.settle_time:g}",
        **_clock(physics, config.trials.settle_time),
        "n_frequencies": len(servo.FREQUENCIES),
        "frequencies": _numbers(servo.FREQUENCIES),
        "n_phases": len(servo.PHASES),
        "phases": _numbers(servo.PHASES),
        "input_names": "\n".join(f"//   {i}: {_comment(name)}" for i, name in enumerate(task.inputs)),
        "input_units": _numbers(unit / protocol.THOUSANDTHS for unit in task.units),
        "line_format": _comment(protocol.line_format(task)),
        **_network(Plan(driving(solution.controller, config.trials), 2 * n), task.n_inputs),
        "n_cables": len(t.SERVO_NODES),
        "servo_nodes": ", ".join(map(str, t.SERVO_NODES)),
        "lengths": "\n".join(f"    {{{_numbers(1000.0 * row, 7)}}}," for row in servo.TARGET_LENGTHS),
        "shortest_pulse": SHORTEST_PULSE,
        "longest_pulse": LONGEST_PULSE,
        "start_pin": START_PIN,
        "servos": _servos(pin_map(n), head.module),
        "servos_esp32": _servos({m: _ESP32_PINS[m] for m in range(n)}, head.module),
    }


def _servos(pins: Mapping[int, int], head: int) -> str:
    return "\n".join(
        f"    {{{pin}, {RELEASED_PULSE}, {CONTRACTED_PULSE}}},  // module {t.module_number(module)}"
        f"{', the head' if module == head else ''}"
        for module, pin in pins.items()
    )


def _gaits(recorded: list[RecordedGait], task: Task, physics: Physics) -> dict[str, object]:
    """Return the gaits as lists of switches, gait by gait."""
    gaits, best = fitting(recorded), best_of(recorded)
    names = []
    for k, gait in enumerate(gaits):
        held = physics.control_period * gait.held
        name = f"//   gait {k + 1}: target {_comment(task.target_names[gait.target])},"
        name += f" {100 * gait.gained:.1f} cm closer"
        name += ", the best" if k == best else ""
        names.append(name + (f"; choices held for at least {held:g} s" if gait.held > 1 else ""))
    first = np.cumsum([0, *(len(g.switches) for g in gaits)])
    rows = [", ".join(map(str, row)) for g in gaits for row in g.choices.tolist()]
    return {
        "n_gaits": len(gaits),
        "best_gait": best,
        "gait_names": "\n".join(names),
        "gait_first": ", ".join(map(str, first)),
        "switch_at": _wrapped(", ".join(str(at) for g in gaits for at in g.switches)),
        "switch_to": "\n".join(f"    {{{row}}}," for row in rows),
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
