"""The kind of computer: the processor's features and the versions that decide a simulation's last bits."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib.metadata
import json
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, Self

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.errors import InvalidData, one_line
from engine.simulation.model import build_spec
from engine.simulation.physics import Physics, Simulator
from engine.tasks import task_version

KNOWN_SIMULATION: Final = Path(__file__).parents[1] / "data" / "known_simulation.json"
"""Recorded by ``engine.simulation.self_check``."""
_CPUINFO: Final = Path("/proc/cpuinfo")
_SIMD: Final = ("avx512f", "avx2", "fma", "avx", "sse4_2", "sve", "asimd")
"""Instruction sets that numerical libraries choose their code by, the widest first."""


MAX_TEXT: Final = 200
"""Largest number of characters that are read of a fact in a run file."""


@dataclasses.dataclass(frozen=True, slots=True)
class Computer:
    """A kind of computer; computers of the same kind compute the same bits.

    Attributes:
        machine: its architecture, such as ``x86_64``.
        simd: instruction sets that it has, of those that numerical libraries choose between.
        mujoco, numpy: versions.
    """

    machine: str
    simd: str
    mujoco: str
    numpy: str

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Read one back from its fields.

        Raises:
            InvalidData: the fields do not describe a computer.
        """
        names = [f.name for f in dataclasses.fields(cls)]
        if not isinstance(data, dict) or not all(isinstance(data.get(n), str) for n in names):
            raise InvalidData(f"a computer is described by {', '.join(names)}")
        return cls(**{n: one_line(data[n][:MAX_TEXT]) for n in names})

    def __str__(self) -> str:
        simd = self.simd or "unknown instruction sets"
        return f"{self.machine} with {simd}, MuJoCo {self.mujoco}, NumPy {self.numpy}"


@dataclasses.dataclass(frozen=True, slots=True)
class Origin:
    """The origin of an evaluation: the computer, and its CPU seconds if they were measured."""

    computer: Computer
    seconds: float | None = None


@functools.cache
def this_computer() -> Computer:
    """Return the kind of computer that this process runs on."""
    return Computer(
        machine=platform.machine(),
        simd=_simd(),
        mujoco=importlib.metadata.version("mujoco"),
        numpy=importlib.metadata.version("numpy"),
    )


def differing(computers: Sequence[Computer]) -> list[str]:
    """Return one line for each property in which computers differ, its values in the order given."""
    lines = []
    for field in dataclasses.fields(Computer):
        values = list(dict.fromkeys(getattr(c, field.name) or "unknown" for c in computers))
        if len(values) > 1:
            lines.append(f"{field.name}: {' | '.join(values)}")
    return lines


def processor_facts() -> dict[str, str]:
    """Return Linux's facts about the first processor, such as its ``model name``; empty on other systems."""
    try:
        text = _CPUINFO.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    lines = (line.partition(":") for line in text.split("\n\n")[0].splitlines())
    return {name.strip(): value.strip() for name, colon, value in lines if colon}


def instruction_sets() -> set[str]:
    """Return the processor's features as the system names them; empty where it does not list them."""
    facts = processor_facts()
    # ARM uses other names
    return set(facts.get("flags", facts.get("Features", "")).split())


def _simd() -> str:
    found = instruction_sets()
    return " ".join(name for name in _SIMD if name in found)


@functools.cache
def body_fingerprint() -> str:
    """Return a hash of how bodies are modelled, apart from the values of ``Physics``.

    Two versions of the program whose fingerprints differ simulate the same robot differently.
    """
    physics = Physics(
        timestep=0.0025,
        control_period=0.02,
        inertia_scale=10.0,
        rod_inertia=3.0,
        friction=0.5,
        impratio=100.0,
        contact_time=0.02,
        contact_damping=1.0,
        servo_noise=t.SERVO_NOISE,
    )
    spec = build_spec(Morphology(5, (1, 2, 3)), physics=physics)
    spec.compile()
    return hashlib.sha256(spec.to_xml().encode()).hexdigest()[:12]


@functools.cache
def kernel_fingerprint() -> str:
    """Return the digest of the kernel's known simulations, see ``engine.simulation.self_check``.

    It changes with the bits that the kernel computes, and with nothing else.
    """
    return str(json.loads(KNOWN_SIMULATION.read_text(encoding="utf-8"))["digest"])


def versions(task: str = "", simulator: Simulator = "kernel") -> dict[str, str]:
    """Return the versions of everything that decides a run's outcome.

    Args:
        task: name of the run's task; if it comes from a user's file, the file's hash is included.
        simulator: the run's; the kernel's bits and its compiler count only where it computes.
    """
    packages = ["tensatlas", "mujoco", "neat-python", "numpy", "scikit-learn"]
    if simulator == "kernel":
        packages += ["numba", "llvmlite"]
    found = {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "physics": body_fingerprint(),
    }
    if simulator == "kernel":
        found["kernel"] = kernel_fingerprint()
    for p in packages:
        try:
            found[p] = importlib.metadata.version(p)
        except importlib.metadata.PackageNotFoundError:
            found[p] = "unknown"
    return found | task_version(task)
