"""The still picture of an episode."""

import dataclasses

import numpy as np
import pytest
from episodes import paired, recorded
from hypothesis import given, strategies as st

from proxytune.driving import shipped_map
from proxytune.report.drive.document import parting
from proxytune.report.drive.figure import episode_figure
from proxytune.report.drive.path import ARROWS, LEAST_M, arrow_rows
from proxytune.report.drive.scene import COLOURS
from proxytune.report.style import COLUMN

PICTURES = np.random.default_rng(1).integers(0, 256, (20, 6, 8, 3), dtype=np.uint8)


def axes_of(figure):
    return [axes for panel in figure.subfigs for axes in panel.axes]


@pytest.fixture
def pair():
    proxy, target = recorded(lambda time: 0.5 * time, pictures=PICTURES), recorded(lambda time: 0.1 * time)
    return paired(proxy, dataclasses.replace(target, pictures=PICTURES))


def texts(axes):
    return [text.get_text() for text in axes.texts]


def test_it_is_one_column_wide_with_map_commands_and_pictures_of_both(pair):
    figure = episode_figure(pair, ["distance"])
    assert figure.get_figwidth() == COLUMN
    ways, commands, *pictures = axes_of(figure)
    assert (ways.get_xlabel(), ways.get_ylabel()) == ("x [m]", "y [m]")
    assert commands.get_xlabel() == "time [s]"
    assert commands.get_ylabel() == "push"
    assert len(pictures) == 8


def test_both_are_named_in_their_colours_with_what_they_scored(pair):
    ways = axes_of(episode_figure(pair, ["distance"]))[0]
    for side, words in (("proxy", "proxy: distance 1 m"), ("target", "target: distance 0.2 m")):
        (text,) = (text for text in ways.texts if text.get_text() == words)
        assert text.get_color() == COLOURS[side]
        assert f"{side} ends" in texts(ways)
    assert "start" in texts(ways)


def test_the_time_at_which_they_part_stands_over_the_commands(pair):
    assert "5 cm apart at 0.2 s (ring on the map)" in texts(axes_of(episode_figure(pair, []))[1])
    assert parting(pair) == "Their places are first more than 5 cm apart at 0.2 s."


def test_an_episode_alone_has_nothing_of_a_target():
    ways, commands = axes_of(episode_figure(paired(recorded(lambda time: 0.5 * time)), []))
    assert texts(ways) == ["start", "proxy ends", "proxy: "]
    assert texts(commands) == []


def test_on_a_road_the_whole_map_is_shown_and_commands_are_duties(pair):
    on_road = dataclasses.replace(pair, road=shipped_map("small_loop"))
    ways, commands, *_ = axes_of(episode_figure(on_road, []))
    assert ways.get_xlim() == (0.0, on_road.road.size[0])
    assert len(ways.images) == 1
    assert commands.get_ylabel() == "push\n[duty]"


def test_a_robot_that_stands_still_can_be_drawn():
    figure = episode_figure(paired(recorded(lambda time: 0.0 * time)), [])
    figure.draw_without_rendering()
    assert len(axes_of(figure)[0].lines) == 3, "path, start and end; no arrow"


@given(st.floats(0.1, 30.0), st.integers(2, 400))
def test_arrows_are_few_and_evenly_spaced_along_the_path(length, rows):
    places = np.column_stack((np.linspace(0.0, length, rows), np.zeros(rows)))
    chosen = arrow_rows(places)
    assert len(chosen) <= ARROWS + 1
    assert all(0 < row < rows for row in chosen)
    gaps = np.diff(places[chosen, 0])
    assert (gaps >= LEAST_M - 2 * length / (rows - 1)).all()
