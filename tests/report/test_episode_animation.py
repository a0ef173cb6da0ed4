"""The moving picture of an episode, and its files."""

import dataclasses
import stat
import sys

import numpy as np
import pytest
from episodes import paired, recorded
from PIL import Image

from proxytune.errors import InputError, RunError
from proxytune.report.drive import movie
from proxytune.report.drive.animation import FRAME_HZ, LINGER_S, Animation
from proxytune.report.drive.movie import ffmpeg, write_gif, write_mp4

PICTURES = np.random.default_rng(1).integers(0, 256, (20, 6, 8, 3), dtype=np.uint8)
ENCODER = """#!{python}
import sys
frames = sys.stdin.buffer.read()
open(sys.argv[-1], "wb").write(b"%d bytes" % len(frames))
"""
BROKEN = """#!{python}
import sys
sys.stdin.buffer.read()
sys.exit("first line\\nUnknown encoder 'h264'")
"""


@pytest.fixture(scope="module")
def animation():
    """The proxy drives for 2 s, the target for 1 s."""
    proxy, target = recorded(lambda t: 0.5 * t, pictures=PICTURES), recorded(lambda t: 0.1 * t, seconds=1.0)
    return Animation(paired(proxy, dataclasses.replace(target, pictures=PICTURES[:10])))


@pytest.fixture
def program(tmp_path, monkeypatch):
    """Put a program in the place of ffmpeg."""

    def put(text):
        path = tmp_path / "bin" / "ffmpeg"
        path.parent.mkdir()
        path.write_text(text.format(python=sys.executable))
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setattr(movie, "ffmpeg", lambda: str(path))

    return put


def halves(frame):
    middle = frame.shape[1] // 2
    return frame[:, :middle], frame[:, middle:]


def test_it_has_ten_frames_a_second_to_the_end_of_the_longer_and_lingers(animation):
    times = np.array(animation.times)
    assert np.allclose(times[:21], np.arange(21) / FRAME_HZ)
    assert len(times) == 21 + LINGER_S * FRAME_HZ
    assert (times[20:] == times[20]).all()


def test_frames_are_of_even_size_as_encoders_ask_for(animation):
    rows, columns, colours = animation.frame(0.0).shape
    assert (rows % 2, columns % 2, colours) == (0, 0, 3)


def test_a_frame_depends_on_its_time_alone(animation):
    first = animation.frame(0.3)
    assert not np.array_equal(animation.frame(1.2), first)
    assert np.array_equal(animation.frame(0.3), first)


def test_a_side_that_has_ended_stays_as_it_was_while_the_other_goes_on(animation):
    (proxy, target), (proxy_later, target_later) = halves(animation.frame(1.0)), halves(animation.frame(1.7))
    assert np.array_equal(target, target_later)
    assert not np.array_equal(proxy, proxy_later)


def test_the_camera_shows_the_picture_of_its_time(animation):
    bright = dataclasses.replace(recorded(lambda t: 0.5 * t), pictures=np.zeros((20, 6, 8, 3), np.uint8))
    bright.pictures[10:] = 255
    one = Animation(paired(bright))
    dark = [(one.frame(time)[-200:, :200] < 5).all(axis=-1).mean() for time in (0.9, 1.0)]
    assert dark[0] > 0.3 > dark[1]


def test_a_gif_has_every_frame_at_its_time_and_plays_for_ever(animation, tmp_path):
    path = tmp_path / "new" / "episode.gif"
    shown = animation.times[:21]
    write_gif(path, map(animation.frame, shown), animation.samples(), FRAME_HZ)
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.info["duration"], gif.info["loop"]) == (21, 100, 0)
        gif.seek(12)
        drawn = np.asarray(gif.convert("RGB")).astype(int)
    assert np.abs(drawn - animation.frame(shown[12])).mean() < 4.0
    assert (drawn[0, 0] == 255).all(), "white stays white"
    assert [file.name for file in path.parent.iterdir()] == ["episode.gif"]


def test_a_gif_that_fails_half_way_leaves_the_old_one(animation, tmp_path):
    path = tmp_path / "episode.gif"
    path.write_text("old")

    def frames():
        yield animation.frame(0.0)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_gif(path, frames(), animation.samples(), FRAME_HZ)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_mp4_is_every_pixel_of_every_frame_given_to_ffmpeg(program, tmp_path):
    program(ENCODER)
    frames = [np.full((6, 8, 3), grey, np.uint8) for grey in (0, 100, 200)]
    write_mp4(tmp_path / "episode.mp4", frames, FRAME_HZ)
    assert (tmp_path / "episode.mp4").read_text() == f"{3 * 6 * 8 * 4} bytes"


def test_an_encoder_that_fails_is_told_in_one_line_and_leaves_nothing(program, tmp_path, caplog):
    program(BROKEN)
    with pytest.raises(RunError) as problem:
        write_mp4(tmp_path / "episode.mp4", [np.zeros((6, 8, 3), np.uint8)], FRAME_HZ)
    assert str(problem.value).endswith(
        "episode.mp4: ffmpeg cannot encode it (Unknown encoder 'h264'); write a .gif instead"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["bin"]
    assert caplog.text == ""


def test_without_an_encoder_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"pip install imageio-ffmpeg, or write a \.gif"):
        ffmpeg()
