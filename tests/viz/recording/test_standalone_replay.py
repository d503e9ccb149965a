import base64
import json
import re

import numpy as np
import pytest

from engine.errors import ExportError
from engine.replay.replay import Replay
from engine.storage.reader import RunReader
from engine.tasks import get_task
from tests.support.unpacked import unpack
from viz.recording.standalone_replay import DETAIL, json_text, page, standalone_replay
from viz.robot.geometry import RobotGeometry


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
    (trial,) = scene["trials"]
    assert trial["frames"] == len(frames)
    assert scene["step"] == DETAIL.step == 1e-4
    geometry = RobotGeometry(replay.morphology, replay.head.module)
    drawn = [geometry.draw(f.pose, f.lengths) for f in frames]
    expected = np.array([d.nodes for d in drawn])
    n, tensions = expected[0].size, drawn[0].tension.size
    (columns,) = unpack(base64.b64decode(element(page, "frames")), [len(frames)], n + tensions)
    points = columns[:, :n].reshape(expected.shape)
    np.testing.assert_allclose(scene["origin"] + DETAIL.step * points, expected, rtol=0, atol=0.51e-4)
    assert scene["told"] * scene["modules"] == tensions
    told = columns[:, n:] / scene["levels"]
    assert scene["levels"] == 31
    assert np.abs(told - [d.tension for d in drawn]).max() <= 0.51 / 31
    assert scene["start"] + trial["frames"] * scene["period"] == pytest.approx(frames[-1].time)
    np.testing.assert_allclose(trial["target"], replay.target)


def test_texts_cannot_break_out_of_the_page(replay):
    page = standalone_replay(replay, run="</script><script>alert(1)</script>", where="<b>").decode()
    assert "alert(1)</script>" not in page
    assert "<b>" not in page
    assert get_task(replay.config.task).target_names[2] in page
    assert standalone_replay(replay, run="a") == standalone_replay(replay, run="a")


def test_what_a_part_of_a_page_holds_is_no_place_and_ends_no_element():
    made = page("<p>@title@</p>@scene@", style="", script="", fields={"title": "@scene@", "scene": "1"})
    assert made == b"<p>@scene@</p>1"
    assert "<" not in json_text({"</script>": "<!--"})


def test_a_replay_that_failed_is_refused(small_run):
    with RunReader(small_run) as reader:
        evaluation = reader.evaluation(0)
        with pytest.raises(ExportError, match="nothing was simulated"):
            standalone_replay(Replay(reader.config, evaluation), run="small")
