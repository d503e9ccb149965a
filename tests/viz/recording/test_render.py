import io
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from engine.errors import ExportError
from engine.replay.replay import Replay
from engine.storage.reader import RunReader
from engine.tasks.walls import Wall
from viz import theme
from viz.recording import video
from viz.recording.primitives import PerspectiveCamera, ReplayLook
from viz.recording.render import Renderer

SIZE = (480, 270)


@pytest.fixture(scope="module")
def replay(small_run):
    with RunReader(small_run) as reader:
        evaluation = next(e for e in reader.all_evaluations() if e.fitness is not None)
        replay = Replay(reader.config, evaluation, target=1)
        replay.advance(replay.end_time)
        return replay


def count(image, color, tolerance=40):
    """Return how many pixels are about a colour."""
    pixels = np.asarray(image).astype(int)
    return int((np.abs(pixels - color).max(axis=-1) < tolerance).sum())


coordinates = st.floats(-1.0, 1.0)


@given(st.lists(st.tuples(coordinates, coordinates, st.floats(0.0, 0.3)), min_size=1, max_size=8))
def test_a_camera_is_moved_until_it_shows_all_points(points):
    points = np.array(points)
    camera = PerspectiveCamera(np.zeros(3), -2.1, 0.6, 1.0, SIZE).showing(points)
    pixels, ahead, _ = camera.project(points)
    assert (ahead > 0).all()
    assert (pixels >= 0).all()
    assert (pixels <= SIZE).all()


def test_what_the_camera_looks_at_is_the_middle_and_up_is_up():
    camera = PerspectiveCamera(np.array([0.1, 0.2, 0.0]), 0.3, 0.5, 2.0, SIZE)
    pixels, ahead, _ = camera.project(np.array([[0.1, 0.2, 0.0], [0.1, 0.2, 0.1]]))
    np.testing.assert_allclose(pixels[0], [240, 135])
    np.testing.assert_allclose(ahead[0], 2.0)
    assert pixels[1, 0] == pytest.approx(240)
    assert pixels[1, 1] < 135
    np.testing.assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(camera.axes) == pytest.approx(-1)  # right, up, ahead


def test_the_picture_shows_robot_target_and_trail(replay):
    renderer = Renderer(replay, ReplayLook(size=SIZE), run="small")
    settling, end = renderer.picture(-0.2), renderer.picture(2.0)
    assert end.size == SIZE
    assert count(settling, theme.TARGET) < 5 < count(end, theme.TARGET)
    assert count(end, np.array(theme.SERVO_ROD) * 0.86) > 20
    assert renderer.png(2.0) == Renderer(replay, ReplayLook(size=SIZE), run="small").png(2.0)
    # past the end stays the end
    assert np.array_equal(renderer.picture(2.0001), renderer.picture(99.0))
    light = Renderer(replay, ReplayLook(size=SIZE, light=True)).picture(1.0)
    assert np.asarray(light).mean() > 200 > 60 > np.asarray(end).mean()


def test_frames_between_two_of_the_simulation_lie_between_them(replay):
    renderer = Renderer(replay, ReplayLook(size=SIZE, caption=False))
    images = [np.asarray(renderer.picture(t)).astype(int) for t in (1.0, 1.02, 1.04)]
    assert 0 < np.abs(images[1] - images[0]).sum() < 2 * np.abs(images[2] - images[0]).sum()


def test_no_seam_where_the_moving_part_meets_the_walls(replay, monkeypatch):
    wall = Wall(centre=(0.1, 0.0, 0.06), half_size=(0.02, 2.0, 0.06))
    standing = Replay(replay.config, replay.evaluation, target=1)
    standing.frames, standing.target, standing.walls = replay.frames, replay.target, (wall,)
    renderer = Renderer(standing, ReplayLook(size=SIZE, caption=False))
    shown = np.asarray(renderer.picture(1.0)).astype(int)
    alone = np.asarray(renderer._backgrounds[True][1]).astype(int)
    changed = (np.abs(shown - alone).max(axis=-1) > 8).mean()
    assert 0.0 < changed < 0.12
    # drawing only what moves gives what drawing everything anew gives
    monkeypatch.setattr(renderer, "_region", lambda _: (0, 0, *renderer._big))
    whole = np.asarray(renderer.picture(1.0)).astype(int)
    assert np.abs(shown - whole).max() <= 8


def test_a_replay_that_has_not_begun_is_refused(replay):
    with pytest.raises(ExportError, match="nothing was simulated"):
        Renderer(Replay(replay.config, replay.evaluation))


def test_a_video_has_every_frame_at_its_time(replay):
    av = pytest.importorskip("av")
    told = []
    content = video.video(
        replay, look=ReplayLook(size=SIZE), progress=lambda n, total: told.append((n, total))
    )
    assert told[-1] == (60, 60)
    with av.open(io.BytesIO(content)) as container:
        stream = container.streams.video[0]
        frames = list(container.decode(stream))
        assert (stream.width, stream.height, stream.average_rate) == (*SIZE, 30)
    assert [round(float(f.time) * 30) for f in frames] == list(range(60))
    shown = frames[45].to_ndarray(format="rgb24").astype(int)
    expected = np.asarray(Renderer(replay, ReplayLook(size=SIZE)).picture(45 / 30)).astype(int)
    assert np.abs(shown - expected).mean() < 4


def test_the_clock_of_a_video_is_not_blended_with_what_it_showed_before(replay):
    av = pytest.importorskip("av")
    look = ReplayLook(size=SIZE)
    pictures = Renderer(replay, look)

    def clock(image):
        return np.asarray(image).astype(float)[255:, 440:]

    with av.open(io.BytesIO(video.video(replay, look=look))) as container:
        shown = [clock(frame.to_ndarray(format="rgb24")) for frame in container.decode(video=0)]
    off = [shown[k] - clock(pictures.picture(k / 30)) for k in range(6, 60, 6)]
    assert max(np.sqrt((d**2).mean()) for d in off) < 9.0


@pytest.mark.parametrize("encoder", list(video.ENCODERS))
def test_every_encoder_makes_a_video_where_there_is_one(replay, encoder):
    av = pytest.importorskip("av")
    try:
        av.codec.Codec(encoder, "w")
    except ValueError:
        pytest.skip(f"this FFmpeg has no {encoder}")
    content = video.video(replay, look=ReplayLook(size=(160, 90)), speed=8.0, encoder=encoder)
    with av.open(io.BytesIO(content)) as container:
        assert len(list(container.decode(video=0))) == 8


def test_a_video_that_nobody_wants_any_more_ends(replay):
    pytest.importorskip("av")

    class NotWantedError(Exception):
        pass

    def stop(n, total):
        if n == 3:
            raise NotWantedError

    with pytest.raises(NotWantedError):
        video.video(replay, look=ReplayLook(size=(160, 90)), progress=stop)


def test_without_pyav_one_is_told_what_to_install(replay, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(ExportError, match=r"tensatlas\[video\]"):
        video.video(replay)


def test_a_png_is_a_png(replay):
    content = Renderer(replay, ReplayLook(size=(160, 90))).png(0.5)
    assert Image.open(io.BytesIO(content)).size == (160, 90)
