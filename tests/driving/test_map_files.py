"""A map of one's own is a file beside the study; what cannot be driven is refused in one line."""

import re
from pathlib import Path

import pytest

from proxytune.domain import make_episode
from proxytune.driving.family import lane_following
from proxytune.driving.road.reading import map_names, read_map, shipped_map
from proxytune.driving.road.segments import Arc, Straight
from proxytune.driving.robot import robot_names
from proxytune.errors import SettingsError
from proxytune.settings import Section
from proxytune.shipped import shipped

HORSESHOE = (shipped("robots") / "maps" / "horseshoe.toml").read_text(encoding="utf-8")
LOOP = (shipped("robots") / "maps" / "small_loop.toml").read_text(encoding="utf-8")
LEFT = "{ radius = 0.2925, turn = 90.0 }"


def family(folder, name="mine.toml", **domain):
    values = {"plant": "planar", "map": name, "seconds": 1.0, **domain}
    return lane_following(Section(folder / "study.toml", "domain.", values), model=None)


def written(folder, text):
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def changed(text, old, new, times=1):
    assert old in text
    return text.replace(old, new, times)


def refusal(folder, text):
    """What is said of a map after its path, on one line."""
    path = written(folder, text)
    with pytest.raises(SettingsError) as caught:
        family(folder)
    said = str(caught.value)
    assert "\n" not in said
    assert said.startswith(f"{path}: ")
    return said.removeprefix(f"{path}: ")


def figure_eight():
    head, tail = LOOP.split("segments = [")
    eight = [LEFT] * 3 + ["{ straight = 0.6 }"] + ["{ radius = 0.2925, turn = -90.0 }"] * 3 + ["{ straight = 0.6 }"]
    return f"{head}segments = [{', '.join(eight)}]{tail.split(']', 1)[1]}"


def overlapping():
    """The horseshoe with its middle let down by 20 cm onto the way below."""
    before, after = HORSESHOE.split("    { radius = 0.2925, turn = -90.0 },\n", 1)
    middle, rest = after.split("    { radius = 0.2925, turn = -90.0 },\n", 1)
    bend, down = "    { radius = 0.2925, turn = -90.0 },\n", "    { straight = 0.2 },\n"
    return before + down + bend + middle + bend + down + rest


def test_maps_that_travel_along_are_no_robots():
    assert set(map_names()) == {"horseshoe", "small_loop"}
    assert "maps" not in robot_names()


def test_an_unknown_map_is_told_with_the_nearest():
    with pytest.raises(SettingsError, match=r"map 'horse_shoe' is unknown; did you mean 'horseshoe'\?"):
        shipped_map("horse_shoe")


@pytest.mark.slow
def test_a_map_beside_the_study_is_driven(tmp_path):
    written(tmp_path, HORSESHOE)
    mine, theirs = family(tmp_path), family(tmp_path, "horseshoe")
    assert mine.map.name == "mine"
    assert mine.starts == 10
    episode = make_episode({}, agent="steady", start=2, seed=3)
    assert mine.run(episode) == theirs.run(episode)
    assert mine.run(episode) != family(tmp_path, "small_loop").run(episode)


def test_what_a_map_file_says_is_part_of_the_family(tmp_path):
    written(tmp_path, HORSESHOE)
    before, same = family(tmp_path), family(tmp_path)
    assert before == same
    assert before.identity == same.identity
    written(tmp_path, changed(HORSESHOE, "white_width = 0.048", "white_width = 0.047"))
    assert family(tmp_path) != before
    assert family(tmp_path).identity != before.identity


def test_segments_are_read_in_their_order():
    loop = shipped_map("small_loop")
    assert loop.segments == (Straight(0.585), Arc(0.2925, 90.0)) * 4
    assert loop.paint.bend_radius == 0.17


def test_bends_are_painted_on_the_roads_own_radius_where_the_file_says_nothing(tmp_path):
    assert read_map(written(tmp_path, changed(LOOP, "bend_radius = 0.17\n", ""))).paint.bend_radius is None


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("size", "sise", "sise: unknown key; did you mean 'size'?"),
        ("lane_width", "lane_with", "road.lane_with: unknown key; did you mean 'lane_width'?"),
        ("white_width = 0.048\n", "", "paint.white_width: is missing; add it"),
        ("white_width", "withe_width", "paint.withe_width: unknown key"),
        ("format = 1", "format = 2", "format: must be between 1 and 1, got 2"),
        ("[1.755, 1.755]", "1.755", "size: must be a list of 2 finite numbers, got 1.755"),
        ("[1.755, 1.755]", "[1.755, true]", "size: must be a list of 2 finite numbers"),
        ("[1.755, 1.755]", f"[1.755, 1{'0' * 400}]", "size: must be a list of 2 finite numbers"),
        ("[1.755, 1.755]", "[1.755, inf]", "size: must be a list of 2 finite numbers"),
        ("[1.755, 1.755]", "[1.755, 11.0]", "size: each side must be above 0 and at most 10 m"),
        ("size = [1.755, 1.755]\n", "", "size: must be a list of 2 finite numbers, got None"),
        ("begin = [1.4625, 0.585, 90.0]\n", "", "road.begin: must be a list of 3 finite numbers"),
        ("{ straight = 0.585 }", "0.585", "road.segments[0]: must be { straight = M } or { radius = M"),
        ("straight =", "strait =", "road.segments[0].strait: unknown key; did you mean 'straight'?"),
        ("= 0.585 }", "= 0.585, turn = 3 }", "road.segments[0].turn: unknown key"),
        ("straight = 0.585", "straight = -1.0", "road.segments[0].straight: must be between 0.001 and"),
        ("turn = 90.0", "turn = 180.0", "road.segments[1].turn: must be between -90 and 90, got 180.0"),
        ("turn = 90.0", "turn = 0.0", "road.segments[1].turn: must not be 0; write { straight = M }"),
        ("radius = 0.2925, ", "", "road.segments[1].radius: is missing; add it"),
        (
            "radius = 0.2925",
            "radius = 0.2",
            "road.segments[1].radius: 0.2 m is too tight a bend for a road 0.585 m wide",
        ),
        (
            "turn = 90.0",
            "turn = 80.0",
            "road.segments: the road does not close: its turns add up to 350°; make it 360°",
        ),
        ("1.4625, 0.585, 90.0", "1.5, 0.585, 90.0", "road.segments: the road leaves the map at (1.7"),
        ("lane_width = 0.22", "lane_width = 0.3", "road.lane_width: the two lanes overlap at 0.3 m"),
        ("width = 0.585", "width = 0.4", "road.width: 0.4 m has no room for two lanes; at least 0.4774 m"),
        ("bend_radius = 0.17", "bend_radius = 0.3", "paint.bend_radius: 0.3 m is wider than a bend; at most 0.2925"),
        ("[0.4237, 0.702", "[0.8775, 0.8775", "starts[0]: lies 0.714 m beside the lane that runs its way"),
        ("[0.4237, 0.702, 104.3]", "[0.4, 0.7]", "starts[0]: must be a list of 3 finite numbers, got"),
        ("starts = [", "starts = []\nmore = [", "more: unknown key"),
    ],
)
def test_a_mistake_in_a_map_file_is_one_line_with_file_and_key(tmp_path, old, new, says):
    assert refusal(tmp_path, changed(LOOP, old, new)).startswith(says)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            changed(LOOP, "straight = 0.585", "straight = 0.7"),
            "does not close: it ends at (1.462, 0.700), 0.115 m from",
        ),
        (changed(LOOP, "turn = 90.0", "turn = -90.0", 4), "runs clockwise; lay it counter-clockwise"),
        (figure_eight(), "does not close: its turns add up to 0°; make it 360°"),
        (overlapping(), "overlaps itself at ("),
    ],
)
def test_a_road_that_is_no_simple_loop_is_refused(tmp_path, text, says):
    assert refusal(tmp_path, text).startswith(f"road.segments: the road {says}")


def test_a_map_without_starts_is_refused(tmp_path):
    empty = re.sub(r"starts = \[\n.*?\n\]", "starts = []", LOOP, flags=re.DOTALL)
    assert refusal(tmp_path, empty) == "starts: must be a list with something in it, got []"


def test_a_map_file_that_is_not_there_is_one_line(tmp_path):
    with pytest.raises(SettingsError, match=r"gone\.toml: no such file; check the path"):
        family(tmp_path, "gone.toml")


def test_a_map_by_an_unknown_name_is_told_of_both_kinds(tmp_path):
    with pytest.raises(SettingsError) as caught:
        family(Path(), "horse")
    assert "domain.map: unknown value 'horse'; did you mean 'horseshoe'?" in str(caught.value)
    assert "ends in .toml" in str(caught.value)
