"""Workers of a Dask cluster: any number of machines behind one scheduler, which may come and go.

When a worker dies, Dask counts this against every job that it had been given, begun or not. So that only the
job at fault is given up, each job is given to one worker with a free thread, and to no other.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import itertools
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final, Self

from engine.errors import ClusterError
from engine.simulation.evaluation import Solution
from engine.workers.job import Result, World, compute
from engine.workers.pool import Died

CONNECT_TIMEOUT: Final = 20.0
"""Seconds within which a scheduler must answer."""
REFRESH: Final = 2.0
"""Seconds after which the threads of the workers are counted again."""
FETCH_TIMEOUT: Final = 60.0
"""Seconds within which the result of a finished job must arrive from a living worker."""
LOST: Final = Died("a worker of the Dask cluster was lost with it")
_POLL: Final = 0.01
_FIND: Final = "str(getattr(__import__('importlib.util').util.find_spec('engine'), 'origin', None))"
_IS_OURS: Final = (
    "(lambda s: s is not None and any(__import__('os').path.exists(p + '/workers/job.py')"
    " for p in s.submodule_search_locations or ()))(__import__('importlib.util').util.find_spec('engine'))"
)
"""Evaluated elsewhere: where the package ``engine`` is, and whether it is TensAtlas's. It is not imported."""
EXTRA: Final = "a cluster needs the package distributed: pip install 'tensatlas[cluster]'"


@dataclasses.dataclass(frozen=True, slots=True)
class _Flight:
    """A job that a worker has."""

    solutions: Sequence[Solution]
    worker: str
    future: Any


class DaskWorkers:
    """The workers of one scheduler. A context manager.

    Args:
        cluster: the address of a scheduler, ``tcp://HOST:PORT``, or one of Dask's cluster objects,
            which is closed in the end.
        keep_up: called every few seconds, to replace lost workers.

    Raises:
        ClusterError: Dask is not installed, or the scheduler does not answer.
    """

    def __init__(self, cluster: Any, *, keep_up: Callable[[], None] | None = None) -> None:
        self._dask = distributed = _distributed()
        self._keep_up = keep_up
        self._cluster = None if isinstance(cluster, str) else cluster
        where = cluster if isinstance(cluster, str) else cluster.scheduler_address
        try:
            # not the default: nothing else in this process shall use this client by accident
            self._client = distributed.Client(where, timeout=CONNECT_TIMEOUT, set_as_default=False)
        except (OSError, ValueError) as e:
            raise ClusterError(f"no Dask scheduler answers at {where}: {_line(e)}") from None
        self._where = where
        self._check_package("the Dask scheduler", self._client.run_on_scheduler)
        self._finished = distributed.as_completed(with_results=False, loop=self._client.loop)
        self._queue: deque[tuple[World, Sequence[Solution]]] = deque()
        self._flying: dict[str, _Flight] = {}
        self._threads: dict[str, int] = {}
        self._counted_at = -REFRESH
        self._count = itertools.count()
        self._session = uuid.uuid4().hex[:8]

    @property
    def n_workers(self) -> int:
        """Number of the workers' threads now."""
        return sum(self._client.nthreads().values())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(Exception):  # a cluster that is gone needs no goodbye
            self._client.cancel(list(self._finished.futures), force=True)
            self._client.close(timeout=5)
        if self._cluster is not None:
            self._cluster.close()

    def submit(self, world: World, solutions: Sequence[Solution]) -> None:
        """Submit a job of some solutions; jobs are begun in the order of submission."""
        self._queue.append((world, solutions))

    def wait(self) -> list[tuple[Sequence[Solution], list[Result] | Died]]:
        """Return the jobs finished since the last call; wait for at least one.

        Raises:
            TensAtlasError: a job fails by an error that the user can mend, or the scheduler is gone.
        """
        with self._reachable():
            while True:
                found = self._lost()
                if self._finished.has_ready():
                    found += filter(None, map(self._outcome, self._finished.next_batch(block=False)))
                self._begin()
                if found:
                    return found
                time.sleep(_POLL)

    def _lost(self) -> list[tuple[Sequence[Solution], list[Result] | Died]]:
        """Check from time to time which workers are left; return the jobs of lost ones."""
        now = time.monotonic()
        if now - self._counted_at < REFRESH:
            return []
        if self._keep_up is not None:
            self._keep_up()
        threads = dict(self._client.nthreads())
        if new := [address for address in threads if address not in self._threads]:
            run = functools.partial(self._client.run, workers=new, on_error="return")
            self._check_package("a worker of the Dask cluster", run)
        self._threads, self._counted_at = threads, now
        gone = {
            k: f for k, f in self._flying.items() if f.worker not in self._threads and not f.future.done()
        }
        for key, flight in gone.items():
            del self._flying[key]
            flight.future.cancel()
        return [(flight.solutions, LOST) for flight in gone.values()]

    def _check_package(self, who: str, run: Callable[..., Any]) -> None:
        """Make sure that a process of the cluster would import our packages; it would end without a word.

        Raises:
            ClusterError: it has none, or others of the same name come first there.
        """
        try:
            found = run(eval, f"({_IS_OURS}, {_FIND})")
        except Exception:  # whoever is lost meanwhile is noticed otherwise
            return
        for answer in found.values() if isinstance(found, dict) else [found]:
            match answer:
                case (False, "None"):
                    wrong = "lacks TensAtlas"
                case (False, str(where)):
                    wrong = f"imports another package called engine ({where})"
                case _:
                    continue
            raise ClusterError(
                f"{who} {wrong}: install TensAtlas for it, and start it where neither the current folder"
                " nor PYTHONPATH has a package of that name"
            )

    def _begin(self) -> None:
        free = dict(self._threads)
        for flight in self._flying.values():
            free[flight.worker] = free.get(flight.worker, 0) - 1
        for worker, n in free.items():
            for _ in range(min(n, len(self._queue))):
                world, solutions = self._queue.popleft()
                key = f"tensatlas-{self._session}-{next(self._count)}"
                future = self._client.submit(compute, world, solutions, key=key, pure=False, workers=[worker])
                self._flying[key] = _Flight(solutions, worker, future)
                self._finished.add(future)

    def _outcome(self, future: Any) -> tuple[Sequence[Solution], list[Result] | Died] | None:
        flight = self._flying.pop(future.key, None)
        if flight is None:  # given up since
            return None
        try:
            return flight.solutions, self._fetch(flight)
        except (self._dask.KilledWorker, TimeoutError):
            return flight.solutions, LOST
        finally:
            future.release()

    def _fetch(self, flight: _Flight) -> list[Result]:
        """Fetch a result; until then it lies on its worker, and may be lost with it.

        Raises:
            TimeoutError: it does not arrive, or its worker has gone.
        """
        deadline = time.monotonic() + FETCH_TIMEOUT
        while True:
            try:
                return flight.future.result(timeout=REFRESH)
            except TimeoutError:
                if flight.worker not in self._client.nthreads() or time.monotonic() >= deadline:
                    raise

    @contextlib.contextmanager
    def _reachable(self) -> Iterator[None]:
        try:
            yield
        except (OSError, self._dask.CancelledError) as e:  # a closed connection is an OSError of Dask's
            raise ClusterError(f"the Dask scheduler at {self._where} is gone: {_line(e)}") from None


def local_cluster(n_workers: int) -> Any:
    """Return a Dask cluster of processes on this machine, for trials.

    Raises:
        ClusterError: Dask is not installed.
    """
    distributed = _distributed()
    report_deaths()
    return distributed.LocalCluster(
        n_workers=n_workers, threads_per_worker=1, processes=True, dashboard_address=None
    )


def report_deaths() -> None:
    """Make schedulers started by this process report a lost worker, instead of repeating its job often."""
    import dask

    dask.config.set({"distributed.scheduler.allowed-failures": 0})


def _distributed() -> Any:
    """Return Dask's package, an optional dependency.

    Raises:
        ClusterError: it is not installed.
    """
    try:
        import distributed
    except ImportError:
        raise ClusterError(EXTRA) from None
    return distributed


def _line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
