"""A clock that jumps, and readers that do not let go."""

import dataclasses
import sqlite3
import time

import engine.runs.evolve
from engine.storage.reader import RunReader
from engine.storage.writer import LOG_LIMIT, RunWriter
from tests.support.faulty import python
from tests.support.made_up import MADE_UP, made_up_evaluation
from tests.support.run_hash import hash_of

JUMPING = """
import datetime, itertools, random, time
real, rng = time.time, random.Random(0)
class Jumping(datetime.datetime):
    @classmethod
    def now(cls, tz=None):
        return datetime.datetime.fromtimestamp(time.time(), tz)
time.time = lambda: real() + rng.choice([-4e8, -3600, 0, 3600, 4e8])
import engine.storage.writer, engine.storage.lock
engine.storage.writer.datetime = engine.storage.lock.datetime = Jumping
assert len({engine.storage.writer._now() for _ in range(50)}) > 3
engine.runs.evolve.evolve(path, SMALL)
"""


def test_a_clock_that_jumps_changes_dates_only(tmp_path, made_up):
    path = tmp_path / "run.tsmr"
    started = time.monotonic()
    python(JUMPING, path)
    took = time.monotonic() - started
    assert hash_of(path) == hash_of(made_up)
    with RunReader(path) as reader:
        seconds = [g.seconds for g in reader.generations()]
    assert seconds == sorted(seconds)
    assert 0.0 <= seconds[-1] <= took


def log_size(path):
    log = path.with_name(path.name + "-wal")
    return log.stat().st_size if log.exists() else 0


def write(writer, numbers, solution):
    evaluations = [made_up_evaluation(dataclasses.replace(solution, number=n)) for n in numbers]
    # long texts, or it would take many evaluations to fill the log
    writer.add_evaluations(0, [dataclasses.replace(e, fitness=None, failure="x" * 2000) for e in evaluations])


def test_the_log_stays_small_beside_our_readers_and_recovers_from_others(tmp_path):
    path = tmp_path / "run.tsmr"
    solution = engine.config.create_algorithm(MADE_UP).ask()[0]
    with RunWriter.create(path, MADE_UP, {}) as writer, RunReader(path) as reader:
        for i in range(100):
            write(writer, range(40 * i, 40 * i + 40), solution)
            assert reader.n_evaluations() == 40 * i + 40
        assert path.stat().st_size > LOG_LIMIT
        assert log_size(path) < LOG_LIMIT
        # another program that reads and does not let go of what it saw
        stranger = sqlite3.connect(path, isolation_level=None)
        stranger.execute("BEGIN")
        assert stranger.execute("SELECT COUNT(*) FROM evaluations").fetchone() == (4000,)
        for i in range(100, 160):
            write(writer, range(40 * i, 40 * i + 40), solution)
        assert log_size(path) > LOG_LIMIT
        assert reader.n_evaluations() == 6400
        assert stranger.execute("SELECT COUNT(*) FROM evaluations").fetchone() == (4000,)
        stranger.execute("COMMIT")
        for i in range(160, 163):
            write(writer, range(40 * i, 40 * i + 40), solution)
        assert log_size(path) <= LOG_LIMIT
        stranger.execute("BEGIN")
        assert stranger.execute("SELECT COUNT(*) FROM evaluations").fetchone() == (6520,)
        started = time.monotonic()
        reader.close()
        writer.close()
        assert time.monotonic() - started < 10.0
        stranger.close()
    with RunReader(path) as reader:
        assert reader.n_evaluations() == 6520
