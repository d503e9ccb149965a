"""Commands as a user types them."""

from __future__ import annotations

from collections.abc import Callable

Command = Callable[..., tuple[int, str, str]]
"""Runs a command; returns exit status, standard output, standard error."""

TINY = "--preset smoke --evaluations 6 --initial 4 --batch-size 2 --trials.repeats 1 --seed 5".split()
"""Flags of an evolution that takes seconds."""
