"""Logs of drives: read as they were written, refused if they were not."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.drive.eyes import HeadPose, Seen
from app.drive.log import Driven, LogWriter, Record, read_log
from app.drive.path import MeasuredPath
from engine.errors import ExportError, InvalidData
from tests.support.made_up import examples

DRIVEN = Driven(637, 4, "goal-reaching", "mine", False)
PLACES = st.floats(-3.0, 3.0)
RECORDS = st.lists(
    st.tuples(
        st.floats(0.0, 500.0),
        st.none() | st.tuples(PLACES, PLACES, st.floats(-math.pi, math.pi)),
        st.none() | st.tuples(PLACES, PLACES),
        st.text(max_size=20),
        st.lists(st.text(max_size=20), max_size=3),
    ),
    max_size=5,
)


@examples(50)
@given(records=RECORDS)
def test_a_log_is_read_as_it_was_written(tmp_path, records):
    path = tmp_path / "drive.jsonl"
    path.unlink(missing_ok=True)
    log = LogWriter(path, DRIVEN)
    for time, head, target, sent, heard in records:
        pose = None if head is None else HeadPose(*head)
        place = None if target is None else np.array(target)
        log.add(time, Seen(0.0, pose, place, lambda: b""), sent, tuple(heard))
    log.close()
    driven, found = read_log(path)
    assert driven == DRIVEN
    assert len(found) == len(records)
    for record, (time, head, target, sent, heard) in zip(found, records, strict=True):
        assert record.time == pytest.approx(time, abs=1e-4)
        assert (record.sent, record.heard) == (sent, tuple(heard))
        assert (record.head is None, record.target is None) == (head is None, target is None)
        if head is not None:
            assert (record.head.x, record.head.y, record.head.direction) == pytest.approx(head, abs=1e-5)
        if target is not None:
            assert record.target == pytest.approx(np.array(target), abs=1e-5)


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "log").write_text("mine")
    with pytest.raises(ExportError, match="is there already; name another file with --log"):
        LogWriter(tmp_path / "log", DRIVEN)
    with pytest.raises(ExportError, match="cannot be written: No such file"):
        LogWriter(tmp_path / "no folder" / "log", DRIVEN)


FIRST = {"format": "tensatlas-drive", "version": 1, "robot": 1, "modules": 2, "task": "t", "run": ""}
FIRST |= {"simulated": True}


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        ([], "is no log of a drive"),
        (["nonsense"], "is no log of a drive"),
        ([[1, 2]], "is no log of a drive"),
        ([{"format": "tensatlas-drive", "version": 2}], "is of a newer TensAtlas"),
        ([FIRST | {"robot": None}], "what follows line 1 is not what a drive writes"),
        ([FIRST, {"time": 1.0}, {"no time": 1.0}], "what follows line 2 is not"),
        ([FIRST, {"time": 1.0, "head": [1.0, 2.0]}], "what follows line 1 is not"),
        ([FIRST, {"time": 1.0, "head": [1.0, 2.0, 1e9]}], "what follows line 1 is not"),
        ([FIRST, {"time": 1.0, "target": [1.0]}], "what follows line 1 is not"),
        ([FIRST, {"time": 1e300}], "what follows line 1 is not"),
        ([FIRST, '{"time": NaN}'], "what follows line 1 is not"),
        ([FIRST, "[" * 100_000], "what follows line 1 is not"),
    ],
)
def test_what_is_no_log_gets_one_line(tmp_path, lines, reason):
    path = tmp_path / "log"
    path.write_text("\n".join(line if isinstance(line, str) else json.dumps(line) for line in lines))
    with pytest.raises(InvalidData, match=reason):
        read_log(path)


def test_what_cannot_be_read_gets_one_line(tmp_path):
    with pytest.raises(InvalidData, match="cannot be read: No such file"):
        read_log(tmp_path / "none")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidData, match="is no log of a drive"):
        read_log(tmp_path / "bytes")


def crawl(turn, origin, noise=0.0):
    """Return records of a head that rests for 3 s and then goes 1 cm/s to its left, seen from anywhere."""
    rng = np.random.default_rng(1)
    ahead = np.array([math.cos(turn), math.sin(turn)])
    left = np.array([-ahead[1], ahead[0]])
    records = []
    for time in np.arange(0.0, 10.0, 0.04):
        place = origin + left * max(time - 3.0, 0.0) * 0.01 + noise * rng.normal(size=2)
        head = HeadPose(*place, turn + 10 * noise * rng.normal())
        hidden = 5.0 < time < 5.5
        records.append(Record(float(time), None if hidden else head, origin + 0.45 * left))
    return records


@pytest.mark.parametrize(("turn", "origin"), [(0.0, (0.0, 0.0)), (2.5, (0.3, -0.2))])
def test_a_path_is_seen_from_where_the_head_began(turn, origin):
    path = MeasuredPath.of(crawl(turn, np.array(origin)), 3.0)
    assert path.aim.text == "90,45"
    # in a world where the target is elsewhere, as seen from there
    angle, start = path.turn(np.array([1.0, 2.0]), np.array([1.0 - 0.45, 2.0])), np.array([1.0, 2.0])
    c, s = math.cos(angle), math.sin(angle)
    assert start + np.array([[c, -s], [s, c]]) @ path.aim.offset == pytest.approx([0.55, 2.0])
    assert path.times[0] == -3.0
    assert path.at(-9.0) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert path.at(4.0) == pytest.approx([0.0, 0.04], abs=1e-3)
    # hidden: where it was last
    assert path.at(2.4) == pytest.approx(path.at(2.04))
    assert (path.before, path.after) == pytest.approx((0.45, 0.38), abs=1e-3)
    # a camera's noise averages out
    noisy = MeasuredPath.of(crawl(turn, np.array(origin), noise=0.003), 3.0)
    assert noisy.aim.distance == 45
    assert abs(noisy.aim.bearing - 90) <= 1
    assert noisy.at(4.0) == pytest.approx([0.0, 0.04], abs=4e-3)
    # also where it began: the mean of all pictures in which it rests
    assert noisy.places[noisy.times <= 0.0].mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-3)


def test_a_log_without_a_path_gets_one_line():
    records = crawl(0.0, np.zeros(2))
    with pytest.raises(InvalidData, match="no picture in which both tags are seen"):
        MeasuredPath.of([Record(0.0, None, None)], 3.0)
    with pytest.raises(InvalidData, match="times go backwards"):
        MeasuredPath.of([*records, records[0]], 3.0)
    with pytest.raises(InvalidData, match="must be 5 to 300 cm"):
        MeasuredPath.of([Record(0.0, HeadPose(0.0, 0.0, 0.0), np.array([9.0, 0.0]))], 3.0)
