"""What a command costs before it does anything."""

import subprocess
import sys

import pytest

SLOW = (
    "sklearn pandas scipy.stats plotly viser distributed reportlab pyarrow PIL shapely trimesh viz"
    " numba llvmlite"
).split()
"""Packages that take long to import: only commands that need them may wait for them."""


@pytest.mark.parametrize("module", ["app.cli.main", "engine.workers.serving"])
def test_commands_and_workers_start_without_what_few_of_them_need(module):
    code = f"import sys, {module}; print(*sorted(set({SLOW!r}) & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
