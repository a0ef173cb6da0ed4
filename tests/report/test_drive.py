"""Still and moving pictures of an episode."""

import dataclasses
import stat
import sys

import numpy as np
import pytest
from episodes import paired, recorded
from hypothesis import given, strategies as st
from PIL import Image

from proxytune.driving import shipped_map
from proxytune.errors import RunError
from proxytune.report.drive import movie
from proxytune.report.drive.figure import (
    ARROWS,
    COLOURS,
    CORNERS,
    GAP,
    LEAST_M,
    SIZE,
    arrow_rows,
    corners_of,
    episode_figure,
    say_parting,
)
from proxytune.report.drive.movie import FRAME_HZ, LINGER_S, Animation, write_gif, write_mp4
from proxytune.report.figure_style import COLUMN

PICTURES = np.random.default_rng(1).integers(0, 256, (20, 6, 8, 3), dtype=np.uint8)


def axes_of(figure):
    return [axes for panel in figure.subfigs for axes in panel.axes]


@pytest.fixture
def pair():
    proxy, target = recorded(lambda time: 0.5 * time, pictures=PICTURES), recorded(lambda time: 0.1 * time)
    return paired(proxy, dataclasses.replace(target, pictures=PICTURES))


def texts(axes):
    return [text.get_text() for text in axes.texts]


def test_it_is_one_column_wide_with_map_commands_and_pictures_of_both_and_on_a_road_the_whole_map_and_duties(pair):
    figure = episode_figure(pair, ["distance"])
    assert figure.get_figwidth() == COLUMN
    ways, commands, *pictures = axes_of(figure)
    assert (ways.get_xlabel(), ways.get_ylabel()) == ("x [m]", "y [m]")
    assert commands.get_xlabel() == "time [s]"
    assert commands.get_ylabel() == "push"
    assert len(pictures) == 8
    on_road = dataclasses.replace(pair, road=shipped_map("small_loop"), command_unit="duty")
    ways, commands, *_ = axes_of(episode_figure(on_road, []))
    assert ways.get_xlim() == (0.0, on_road.road.size[0])
    assert len(ways.images) == 1
    assert commands.get_ylabel() == "push\n[duty]"


def test_both_are_named_in_their_colours_with_scores_and_the_time_at_which_they_part(pair):
    ways = axes_of(episode_figure(pair, ["distance"]))[0]
    for side, words in (("proxy", "proxy: distance 1 m"), ("target", "target: distance 0.2 m")):
        (text,) = (text for text in ways.texts if text.get_text() == words)
        assert text.get_color() == COLOURS[side]
        assert f"{side} ends" in texts(ways)
    assert "start" in texts(ways)
    assert "5 cm apart at 0.2 s (ring on the map)" in texts(axes_of(episode_figure(pair, []))[1])
    assert say_parting(pair) == "Their places are first more than 5 cm apart at 0.2 s."


def test_an_episode_alone_or_standing_still_can_be_drawn_and_labels_stand_apart_and_hide_no_path():
    ways, commands = axes_of(episode_figure(paired(recorded(lambda time: 0.5 * time)), []))
    assert texts(ways) == ["start", "proxy ends", "proxy: "]
    assert texts(commands) == []
    figure = episode_figure(paired(recorded(lambda time: 0.0 * time)), [])
    figure.draw_without_rendering()
    assert len(axes_of(figure)[0].lines) == 3, "path, start and end; no arrow"
    assert corners_of(np.array([(1.0, 1.0)]), NOTHING, LOW, HIGH) == [(1, 1)]
    path = np.column_stack((np.linspace(1.0, 2.0, 50), np.linspace(1.0, 1.3, 50)))
    (corner,) = corners_of(np.array([(1.0, 1.0)]), path, LOW, HIGH)
    assert corner == tuple(CORNERS[1])


@given(st.floats(0.1, 30.0), st.integers(2, 400))
def test_arrows_are_few_and_evenly_spaced_along_the_path(length, rows):
    places = np.column_stack((np.linspace(0.0, length, rows), np.zeros(rows)))
    chosen = arrow_rows(places)
    assert len(chosen) <= ARROWS + 1
    assert all(0 < row < rows for row in chosen)
    assert (np.diff(places[chosen, 0]) >= LEAST_M - 2 * length / (rows - 1)).all()


LOW, HIGH = np.array((0.0, 0.0)), np.array((2.0, 2.0))
NOTHING = np.empty((0, 2))


def centres(marks, corners):
    return np.array(marks) + np.array(corners) * (SIZE / 2.0 + GAP) * 2.0


@given(st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_a_label_stays_on_the_map(x, y):
    (corner,) = corners_of(np.array([(x, y)]), NOTHING, LOW, HIGH)
    centre = centres([(x, y)], [corner])[0]
    assert (centre - SIZE >= LOW - 1e-9).all()
    assert (centre + SIZE <= HIGH + 1e-9).all()


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_two_marks_close_by_have_labels_apart(x, y):
    marks = np.array([(1.0, 1.0), (1.0 + x, 1.0 + y)])
    one, two = centres(marks, corners_of(marks, NOTHING, LOW, HIGH))
    assert (np.abs(one - two) >= 2.0 * SIZE - 1e-9).any()


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
        monkeypatch.setattr(movie, "find_ffmpeg", lambda: str(path))

    return put


def halves(frame):
    middle = frame.shape[1] // 2
    return frame[:, :middle], frame[:, middle:]


def test_frames_of_even_size_come_ten_a_second_to_the_end_of_the_longer_which_lingers(animation):
    times = np.array(animation.times)
    assert np.allclose(times[:21], np.arange(21) / FRAME_HZ)
    assert len(times) == 21 + LINGER_S * FRAME_HZ
    assert (times[20:] == times[20]).all()
    rows, columns, colours = animation.frame(0.0).shape
    assert (rows % 2, columns % 2, colours) == (0, 0, 3)


def test_a_frame_and_its_picture_depend_on_their_time_alone_and_a_side_that_has_ended_stays(animation):
    first = animation.frame(0.3)
    assert not np.array_equal(animation.frame(1.2), first)
    assert np.array_equal(animation.frame(0.3), first)
    (proxy, target), (proxy_later, target_later) = halves(animation.frame(1.0)), halves(animation.frame(1.7))
    assert np.array_equal(target, target_later)
    assert not np.array_equal(proxy, proxy_later)
    bright = dataclasses.replace(recorded(lambda t: 0.5 * t), pictures=np.zeros((20, 6, 8, 3), np.uint8))
    bright.pictures[10:] = 255
    one = Animation(paired(bright))
    dark = [(one.frame(time)[-200:, :200] < 5).all(axis=-1).mean() for time in (0.9, 1.0)]
    assert dark[0] > 0.3 > dark[1]


def test_a_gif_has_every_frame_at_its_time_and_plays_for_ever(animation, tmp_path):
    path = tmp_path / "new" / "episode.gif"
    shown = animation.times[:21]
    write_gif(path, map(animation.frame, shown), [*map(animation.frame, shown[::10])])
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.info["duration"], gif.info["loop"]) == (21, 100, 0)
        gif.seek(12)
        drawn = np.asarray(gif.convert("RGB")).astype(int)
    assert np.abs(drawn - animation.frame(shown[12])).mean() < 4.0
    assert (drawn[0, 0] == 255).all(), "white stays white"
    assert [file.name for file in path.parent.iterdir()] == ["episode.gif"]


def test_an_mp4_is_every_pixel_of_every_frame_given_to_ffmpeg(program, tmp_path):
    program(ENCODER)
    frames = [np.full((6, 8, 3), grey, np.uint8) for grey in (0, 100, 200)]
    write_mp4(tmp_path / "episode.mp4", frames)
    assert (tmp_path / "episode.mp4").read_text() == f"{3 * 6 * 8 * 4} bytes"


def test_an_encoder_that_fails_is_told_in_one_line_and_leaves_nothing(program, tmp_path, caplog):
    program(BROKEN)
    with pytest.raises(RunError) as problem:
        write_mp4(tmp_path / "episode.mp4", [np.zeros((6, 8, 3), np.uint8)])
    assert str(problem.value).endswith(
        "episode.mp4: ffmpeg cannot encode it (Unknown encoder 'h264'); write a .gif instead"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["bin"]
    assert caplog.text == ""
