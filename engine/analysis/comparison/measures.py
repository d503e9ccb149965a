"""The figures that runs are compared by."""

from __future__ import annotations

import dataclasses
from typing import Final

DASH: Final = "—"
"""Where there is no number."""


@dataclasses.dataclass(frozen=True, slots=True)
class Measure:
    """A figure of the end of a run, of its morphology map where nothing else is said.

    Attributes:
        title: for people; a place ``{threshold}`` is for the threshold in cm.
        unit: ``cm``, ``%``, ``h`` or none.
        digits: after the point.
        column: its name in tables for other programs.
        tested: whether groups are tested on it; larger is better then.
        robust: whether it is known only of runs whose elites were evaluated again.
        sums: whether it is a sum or share over cells, which maps of different shapes cannot be compared by.
    """

    title: str
    unit: str
    digits: int
    column: str
    tested: bool = False
    robust: bool = False
    sums: bool = False

    def text(self, value: float | None) -> str:
        """Return a value or a mean of some for people, a dash for none; a mean of counts may not be whole."""
        if value is None:
            return DASH
        whole = self.unit or float(value).is_integer()
        return number(value, self.digits if whole else 1)

    def named(self, threshold: float) -> str:
        """Return the title.

        Args:
            threshold: in m.
        """
        return self.title.format(threshold=f"{100.0 * threshold:.2f}")


def number(value: float | None, digits: int) -> str:
    """Return a number for people, a dash for none."""
    return DASH if value is None else f"{value:,.{digits}f}".replace("-", "\u2212")


MEASURES: Final = {
    "best": Measure("Best f_s", "cm", 2, "best_f_s_cm", tested=True),
    "qd_score": Measure("QD score", "cm", 1, "qd_score_cm", tested=True, sums=True),
    "offset_qd_score": Measure("QD score with offset", "cm", 0, "offset_qd_score_cm", sums=True),
    "coverage": Measure("Coverage", "%", 1, "coverage_percent", sums=True),
    "above": Measure("Cells above {threshold} cm", "", 0, "cells_above", tested=True, sums=True),
    "robust_best": Measure(
        "Best f_s, mean over fresh noise", "cm", 2, "robust_best_f_s_cm", tested=True, robust=True
    ),
    "robust_qd_score": Measure(
        "QD score, means over fresh noise",
        "cm",
        1,
        "robust_qd_score_cm",
        tested=True,
        robust=True,
        sums=True,
    ),
    "robust_above": Measure(
        "Cells above {threshold} cm, means over fresh noise",
        "",
        0,
        "robust_cells_above",
        tested=True,
        robust=True,
        sums=True,
    ),
    "steering": Measure("Elites that tell left from right", "%", 1, "steering_percent", tested=True),
    "evaluations": Measure("Evaluations", "", 0, "evaluations"),
    "hours": Measure("Computing time", "h", 2, "hours"),
}
"""By name, in the order in which they are shown."""
TRENDS: Final = ("best", "qd_score", "offset_qd_score", "coverage", "above")
"""Of them those known over the evaluations."""
