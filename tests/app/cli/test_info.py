"""``info`` as a user types it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from app.cli.info import computers_differ
from engine.simulation.provenance import Computer
from engine.storage.reader import RunReader
from tests.support.command_line import Command


def test_info_is_readable(tensatlas: Command, small_run: Path) -> None:
    status, out, _ = tensatlas("info", small_run)
    assert status == 0
    assert "goal-reaching" in out
    assert "18 of 18" in out
    assert "QD score" in out
    with RunReader(small_run) as reader:
        elites = reader.elites(reader.finished_generation())["morphology"]
    values = [45 - 100 * s.fitness for _, s in elites.values()]
    (line,) = [line for line in out.splitlines() if line.startswith("morphology")]
    assert f"with offset {sum(v + 45 for v in values):.0f} cm" in line
    assert f"{sum(v > 0.7925 for v in values)} cells above 0.79 cm" in line


def test_instructions_matter_to_mujoco_alone() -> None:
    """The kernel's results have the same bits whatever the processor has."""
    one = Computer("x86_64", "avx2", "4.0.0", "2.4.6")
    other = dataclasses.replace(one, simd="avx512f")
    newer = dataclasses.replace(other, numpy="2.5.0")
    assert computers_differ([one, other], "kernel") == []
    assert computers_differ([one, other], "mujoco") == ["simd: avx2 | avx512f"]
    assert computers_differ([one, newer], "kernel") == ["numpy: 2.4.6 | 2.5.0"]
