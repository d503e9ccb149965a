"""Workers of a Dask cluster: any number of machines behind one scheduler, coming and going as they like.

When a worker dies, Dask suspects every job that it had been given, begun or not. So that the innocent are
not given up with the guilty, no more jobs are handed to the scheduler than its workers have threads.
"""

from __future__ import annotations

import contextlib
import itertools
import time
import uuid
from collections import deque
from collections.abc import Iterator
from typing import Any, Final, Self

from engine.distributed.job import Result, World, compute
from engine.distributed.pool import Died
from engine.errors import ClusterError
from engine.evaluation import Solution

CONNECT_TIMEOUT: Final = 20.0
"""Seconds within which a scheduler must answer."""
REFRESH: Final = 2.0
"""Seconds after which the threads of the workers are counted again."""
_POLL: Final = 0.01
EXTRA: Final = "a cluster needs the package distributed: pip install 'tensatlas[cluster]'"


class DaskWorkers:
    """The workers of one scheduler. A context manager.

    Args:
        cluster: the address of a scheduler, ``tcp://HOST:PORT``, or one of Dask's cluster objects,
            which is closed in the end.

    Raises:
        ClusterError: Dask is not installed, or the scheduler does not answer.
    """

    def __init__(self, cluster: Any) -> None:
        try:
            import distributed
        except ImportError:
            raise ClusterError(EXTRA) from None
        self._dask = distributed
        self._cluster = None if isinstance(cluster, str) else cluster
        where = cluster if isinstance(cluster, str) else cluster.scheduler_address
        try:
            # a call of its own: nothing else in this process shall use this client by default
            self._client = distributed.Client(where, timeout=CONNECT_TIMEOUT, set_as_default=False)
        except (OSError, ValueError) as e:
            raise ClusterError(f"no Dask scheduler answers at {where}: {_line(e)}") from None
        self._where = where
        self._finished = distributed.as_completed(with_results=False, loop=self._client.loop)
        self._queue: deque[tuple[World, Solution]] = deque()
        self._solutions: dict[str, Solution] = {}
        self._n_threads, self._counted_at = 0, -REFRESH
        self._count = itertools.count()
        self._session = uuid.uuid4().hex[:8]

    @property
    def n_workers(self) -> int:
        """How many threads of workers there are now."""
        return sum(self._client.nthreads().values())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(Exception):  # a cluster that is gone needs no goodbye
            self._client.cancel(list(self._finished.futures), force=True)
            self._client.close(timeout=5)
        if self._cluster is not None:
            self._cluster.close()

    def submit(self, world: World, solution: Solution) -> None:
        """Have a solution evaluated; what is submitted first is begun first."""
        self._queue.append((world, solution))

    def wait(self) -> list[tuple[Solution, Result | Died]]:
        """Return what has been finished since the last call; wait until there is something.

        Raises:
            TensAtlasError: a job has an error of the user's, or the scheduler is gone.
        """
        with self._reachable():
            self._begin()
            while not self._finished.has_ready():
                time.sleep(_POLL)
                self._begin()  # a worker may have come
            found = [self._outcome(future) for future in self._finished.next_batch(block=False)]
            self._begin()
            return found

    def _begin(self) -> None:
        now = time.monotonic()
        if now - self._counted_at >= REFRESH:
            self._n_threads, self._counted_at = self.n_workers, now
        while self._queue and len(self._solutions) < self._n_threads:
            world, solution = self._queue.popleft()
            key = f"tensatlas-{self._session}-{next(self._count)}"
            future = self._client.submit(compute, world, [solution], key=key, pure=False)
            self._solutions[key] = solution
            self._finished.add(future)

    def _outcome(self, future: Any) -> tuple[Solution, Result | Died]:
        solution = self._solutions.pop(future.key)
        try:
            return solution, future.result()
        except self._dask.KilledWorker:
            return solution, Died("a worker of the Dask cluster was lost with it")
        finally:
            future.release()

    @contextlib.contextmanager
    def _reachable(self) -> Iterator[None]:
        from distributed.comm import CommClosedError
        from distributed.utils import TimeoutError as DaskTimeout

        try:
            yield
        except (CommClosedError, DaskTimeout, OSError, self._dask.CancelledError) as e:
            raise ClusterError(f"the Dask scheduler at {self._where} is gone: {_line(e)}") from None


def local_cluster(n_workers: int) -> Any:
    """Return a Dask cluster of processes on this machine, for trials.

    Raises:
        ClusterError: Dask is not installed.
    """
    try:
        import distributed
    except ImportError:
        raise ClusterError(EXTRA) from None
    report_deaths()
    return distributed.LocalCluster(
        n_workers=n_workers, threads_per_worker=1, processes=True, dashboard_address=None
    )


def report_deaths() -> None:
    """Make schedulers started by this process report a lost worker, instead of repeating its job often."""
    import dask

    dask.config.set({"distributed.scheduler.allowed-failures": 0})


def _line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
