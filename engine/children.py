"""How a process of the project starts another one: of the same files, whatever lies in the current folder.

``python -m app`` would run somebody else's ``app`` that lies there, or in a folder of ``PYTHONPATH``.
"""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path
from typing import Final

_START: Final = Path(__file__).resolve().parents[1] / "tensatlas.py"


def command_line(*arguments: str) -> list[str]:
    """Return what starts ``tensatlas`` with arguments."""
    # -P: the folder of the file is no place to look for modules
    return [sys.executable, "-P", str(_START), *arguments]


def module_line(module: str, *arguments: str) -> list[str]:
    """Return what runs a module of the project."""
    return command_line("-m", module, *arguments)


def shell_lines(*, same_python: bool) -> list[str]:
    """Return lines of a shell script that let Python find these packages, started there with ``-m``.

    So a folder of packages comes before Python's own modules, which is done only where something else may
    have our names.

    Args:
        same_python: whether it is this one, whose packages are these.
    """
    lines = ["export PYTHONSAFEPATH=1"]
    if same_python and (others := os.environ.get("PYTHONPATH")):
        lines.append(f"export PYTHONPATH={shlex.quote(os.pathsep.join((str(_START.parent), others)))}")
    return lines
