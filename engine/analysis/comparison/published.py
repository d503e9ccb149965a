"""The results of the published experiment, to be put beside ours.

Source: tables 4 to 7 and section 5 of Zardini et al., GECCO 2021; 10 runs of 45,000 evaluations for each
algorithm and task.
"""

from __future__ import annotations

import functools
import json
from importlib import resources
from typing import Any, Final

CITATION: Final = "Zardini et al., GECCO 2021"


@functools.cache
def _tables() -> dict[str, Any]:
    return json.loads((resources.files("engine") / "data" / "published_results.json").read_text("utf-8"))


def n_runs() -> int:
    """Return the number of runs behind every published figure."""
    return int(_tables()["runs"])


def n_evaluations() -> int:
    """Return the number of evaluations of every published run."""
    return int(_tables()["evaluations"])


def statistics(measure: str, task: str, algorithm: str) -> dict[str, float] | None:
    """Return the paper's statistics of a measure over its runs, or None if it gives none.

    Args:
        measure: ``best`` (f_s in cm), ``qd_score`` (of the morphology archive, in cm) or ``hours``.
        task: its name, such as ``goal-reaching``.
        algorithm: its name, such as ``dm-me``.

    Returns:
        ``mean`` and ``std``; for the first two also ``min``, ``max`` and ``median``.
    """
    return _tables()["statistics"].get(measure, {}).get(task, {}).get(algorithm)


def rank_sum_p(measure: str, task: str, first: str, second: str) -> float | None:
    """Return the published p-value of two algorithms' rank-sum test, in either order, or None."""
    found = _tables()["rank_sum_p"].get(measure, {}).get(task, {})
    return found.get(f"{first}|{second}", found.get(f"{second}|{first}"))
