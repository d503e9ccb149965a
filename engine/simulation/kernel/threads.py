"""Work shared by threads: compiled code does not hold the interpreter's lock."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable, Sequence
from typing import TypeVar

R = TypeVar("R")
Q = TypeVar("Q")


def threaded(function: Callable[[Q], R], items: Sequence[Q], n_threads: int) -> list[R]:
    """Return a function's results for items, in their order, computed on some threads."""
    if n_threads == 1 or len(items) == 1:
        return [function(item) for item in items]
    with concurrent.futures.ThreadPoolExecutor(n_threads) as pool:
        return list(pool.map(function, items))
