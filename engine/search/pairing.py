"""Who of two populations is tried with whom, and what somebody tried with several is worth."""

from __future__ import annotations

import random
from collections.abc import Sequence


def pair_randomly(n_left: int, n_right: int, rng: random.Random) -> list[tuple[int, int]]:
    """Pair two populations at random, everybody at least once.

    There are as many pairs as the larger population has members. Of the larger one everybody is in one
    pair; the members of the smaller one take turns, so that two of them differ by one pair at most, and
    who has one more is drawn. For equal sizes the pairing is one-to-one.

    Returns:
        Pairs of indices, no pair twice; empty if a population is.
    """
    if not n_left or not n_right:
        return []
    left, right = list(range(n_left)), list(range(n_right))
    rng.shuffle(left)
    rng.shuffle(right)
    return [(left[i % n_left], right[i % n_right]) for i in range(max(n_left, n_right))]


def paired_fitness(fitnesses: Sequence[float]) -> float:
    """Return mean + 1/2 (max - mean) of the fitnesses, to be minimised, that somebody got with its partners.

    Zardini et al. 2021, equation 2. With one partner it is that fitness, to the last bit.

    Raises:
        ValueError: there is none.
    """
    if not fitnesses:
        raise ValueError("somebody without a partner has no fitness")
    mean = sum(fitnesses) / len(fitnesses)
    # never -0.0, whose sign a run file would not keep
    return mean + 0.5 * (max(fitnesses) - mean) + 0.0
