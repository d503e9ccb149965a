"""A trial has the same bytes whatever instructions the processor has."""

from __future__ import annotations

import dataclasses
import hashlib
import os
import subprocess
import sys

import llvmlite.binding as llvm
import pytest

from engine.tasks import SQUEEZING
from tests.support.kernel_driven import EVERYTHING, MORPHOLOGY, all_bytes, driven, trials

_FEATURES = llvm.get_host_cpu_features()


def trial_hash(width=8):
    """Return a digest of all that is known of three trials of 1.2 s, each without feet and with."""
    found = []
    for feet in ("none", "end"):
        body = dataclasses.replace(MORPHOLOGY, feet=feet)
        three = trials(driven(SQUEEZING, morphology=body), range(3), width=width)
        found += all_bytes(three, three.run(60, EVERYTHING))
    assert found[0] != found[3]
    return hashlib.sha256(b"".join(found)).hexdigest()


@pytest.mark.skipif("sse2" not in _FEATURES, reason="this processor is no x86-64")
@pytest.mark.parametrize("processor", ["x86-64", "x86-64-v3"])
def test_instructions_do_not_matter(processor):
    """With SSE2 alone, and with AVX2 and FMA, as with all that this processor has."""
    if processor == "x86-64-v3" and not _FEATURES.get("fma"):
        pytest.skip("this processor has no FMA")
    environment = os.environ | {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""}
    code = "from tests.engine.simulation.kernel import test_instruction_sets as t; print(t.trial_hash())"
    there = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert there.stdout.split() == [trial_hash()]
