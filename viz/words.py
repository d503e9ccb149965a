"""The sentences that explain what the app and its reports show: one place, so that they say the same."""

from __future__ import annotations

from typing import Final

F_S: Final = (
    "f_s is how many centimetres closer a robot ends to its targets than it started, the worst target"
    " counting extra."
)
QD_SCORE: Final = "The QD score is the sum of f_s over a map's filled cells."
COVERAGE: Final = "The percentage says how many of the cells that a robot can lie in are filled."
STILL: Final = "A pale cell holds a robot that lies still: |f_s| is below {:.2f} cm."
PCA: Final = (
    "PCA 1 and PCA 2 tell apart the ways that the robots' heads take: along these two directions, of all,"
    " the ways of a run's robots differ most."
)
FACES: Final = (
    "Which of its eight faces each module joins the next one with; the last figure is the front of the robot"
    " where its last module is the head."
)
HEAD: Final = (
    "The end of the robot that goes first: distance and bearing of the target, which its network senses, are"
    " taken from there."
)


AGAIN: Final = "mean of {} trials under fresh noise; recorded"
"""What a robot's first figure is, if it was evaluated again; the recorded f_s follows."""


def markup(sentence: str) -> str:
    """Return a sentence as HTML: with the index of f_s below its line."""
    return sentence.replace("f_s", "f<sub>s</sub>")


def plain(sentence: str) -> str:
    """Return a sentence as text for places that have no subscripts, such as titles that a mouse brings up."""
    return sentence.replace("f_s", "fₛ")


def gained(f_s: float, still: float) -> str:
    """Return in words what a robot's f_s says.

    Args:
        f_s: in cm.
        still: in cm, below which a robot counts as lying still.
    """
    if abs(f_s) < still:
        return "lies still"
    return f"{abs(f_s):.1f} cm {'closer' if f_s > 0.0 else 'farther'}"
