"""A trial has the same bytes whatever instructions the processor has, in vectors that suit them."""

from __future__ import annotations

import dataclasses
import hashlib
import os
import subprocess
import sys

import llvmlite.binding as llvm
import pytest

from engine.tasks import GOAL_REACHING, SQUEEZING
from tests.support.kernel_driven import EVERYTHING, MORPHOLOGY, all_bytes, driven, trials

_FEATURES = llvm.get_host_cpu_features()


def trial_hash(width=8):
    """Return a digest of all that is known of three trials of 1.2 s of either task, one with feet."""
    digest = hashlib.sha256()
    for task, feet in ((GOAL_REACHING, "end"), (SQUEEZING, "none")):
        body = dataclasses.replace(MORPHOLOGY, feet=feet)
        three = trials(driven(task, morphology=body, width=width), range(3), width=width)
        digest.update(b"".join(all_bytes(three, three.run(60, EVERYTHING))))
    return digest.hexdigest()


@pytest.mark.parametrize(("processor", "width"), [("x86-64", 2), ("x86-64-v3", 4)])
def test_instructions_and_width_do_not_matter(processor, width):
    """With SSE2 alone, and with AVX2 and FMA, as with all that this processor has in vectors of eight."""
    if processor == "x86-64-v3" and not _FEATURES.get("fma"):
        pytest.skip("this processor has no FMA")
    environment = dict(os.environ)
    if "sse2" in _FEATURES:  # else this processor is no x86-64, and only the width is another one
        environment |= {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""}
    code = "from tests.engine.simulation.kernel import test_instruction_sets as t"
    code = f"{code}; print(t.trial_hash({width}))"
    there = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert there.stdout.split() == [trial_hash()]
