"""Workers of a Dask cluster: any number of machines behind one scheduler.

Dask repeats what a worker leaves unfinished that dies, and lets workers come and go.
"""

from __future__ import annotations

import contextlib
import itertools
import uuid
from collections.abc import Iterator
from typing import Any, Final, Self

from engine.distributed.job import Result, World, compute
from engine.distributed.pool import MAX_DEATHS, Died
from engine.errors import ClusterError
from engine.evaluation import Solution

CONNECT_TIMEOUT: Final = 20.0
"""Seconds within which a scheduler must answer."""
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
        self._solutions: dict[str, Solution] = {}
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
        n = next(self._count)
        key = f"tensatlas-{self._session}-{n}"
        with self._reachable():
            future = self._client.submit(compute, world, [solution], key=key, pure=False, priority=-n)
            self._solutions[key] = solution
            self._finished.add(future)

    def wait(self) -> list[tuple[Solution, Result | Died]]:
        """Return what has been finished since the last call; wait until there is something.

        Raises:
            TensAtlasError: a job has an error of the user's, or the scheduler is gone.
        """
        with self._reachable():
            batch = self._finished.next_batch(block=True)
            return [self._outcome(future) for future in batch]

    def _outcome(self, future: Any) -> tuple[Solution, Result | Died]:
        solution = self._solutions.pop(future.key)
        try:
            return solution, future.result()
        except self._dask.KilledWorker:
            return solution, Died("Dask gave it up after as many deaths as its scheduler allows", final=True)
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
    allow_deaths()
    return distributed.LocalCluster(
        n_workers=n_workers, threads_per_worker=1, processes=True, dashboard_address=None
    )


def allow_deaths() -> None:
    """Make schedulers started by this process give a job up after as many deaths as our own workers do."""
    import dask

    dask.config.set({"distributed.scheduler.allowed-failures": MAX_DEATHS - 1})


def _line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
