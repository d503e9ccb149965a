import base64
import json
import re
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from engine.errors import ExportError
from engine.replay.replay import Replay
from engine.storage.reader import RunReader
from engine.tasks import get_task
from viz.recording.standalone_replay import STEP, TENSION_LEVELS, pack, standalone_replay
from viz.robot.geometry import RobotGeometry


def unpack(packed, shape):
    """Read what ``pack`` wrote, as the viewer does."""
    low, high = np.frombuffer(packed, dtype=np.uint8).astype(np.uint16).reshape(2, shape[1], shape[0])
    return np.cumsum(low + 256 * high, axis=1, dtype=np.uint16).astype(np.int16).T


@given(hnp.arrays(np.int16, st.tuples(st.integers(1, 6), st.integers(1, 5))))
def test_packing_loses_nothing(values):
    np.testing.assert_array_equal(unpack(pack(values), values.shape), values)


@pytest.fixture(scope="module")
def replay(small_run):
    with RunReader(small_run) as reader:
        evaluation = next(e for e in reader.all_evaluations() if e.fitness is not None)
        replay = Replay(reader.config, evaluation, target=2)
        replay.advance(replay.end_time)
        return replay


def element(page, name):
    return re.search(rf'<script type="[^"]*" id="{name}">(.*?)</script>', page, re.S)[1]


def test_the_file_holds_the_motion_to_a_tenth_of_a_millimetre(replay):
    page = standalone_replay(replay, run="small").decode()
    scene = json.loads(element(page, "scene"))
    frames = replay.frames[1::2]
    assert scene["frames"] == len(frames)
    assert scene["step"] == STEP
    geometry = RobotGeometry(replay.morphology, replay.head.module)
    drawn = [geometry.draw(f.pose, f.lengths) for f in frames]
    expected = np.array([d.nodes for d in drawn])
    raw = zlib.decompress(base64.b64decode(element(page, "frames")))
    size = 2 * expected[0].size * len(frames)
    points = unpack(raw[:size], (len(frames), expected[0].size)).reshape(expected.shape)
    np.testing.assert_allclose(scene["origin"] + STEP * points, expected, rtol=0, atol=0.51 * STEP)
    tension = unpack(raw[size:], (len(frames), len(drawn[0].tension)))
    assert np.abs(tension / TENSION_LEVELS - [d.tension for d in drawn]).max() <= 0.51 / TENSION_LEVELS
    assert scene["start"] + scene["frames"] * scene["period"] == pytest.approx(frames[-1].time)
    np.testing.assert_allclose(scene["target"], replay.target)


def test_texts_cannot_break_out_of_the_page(replay):
    page = standalone_replay(replay, run="</script><script>alert(1)</script>", where="<b>").decode()
    assert "alert(1)</script>" not in page
    assert "<b>" not in page
    assert get_task(replay.config.task).target_names[2] in page
    assert standalone_replay(replay, run="a") == standalone_replay(replay, run="a")


def test_a_replay_that_failed_is_refused(small_run):
    with RunReader(small_run) as reader:
        evaluation = reader.evaluation(0)
        with pytest.raises(ExportError, match="nothing was simulated"):
            standalone_replay(Replay(reader.config, evaluation), run="small")
