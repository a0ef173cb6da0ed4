"""Commands at times of their own are read as they were issued, and every complaint says where and what to do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from log_folders import complaint, write_files

from proxytune.errors import LogError
from proxytune.logs import COMMANDS, read_log

TOML = 'format = 1\nname = "yard"\nrobot = "tractor"\ncommand = "twist"\nrate_hz = 10\n'
SAMPLES = "episode,time,x,y,heading\na,5.0,1,2,0\na,5.1,1,2,0\na,5.3,1,2,0\nb,0,0,0,0\nb,0.1,0,0,0\n"
HEADER = "episode,time,v,omega\n"
GOOD = HEADER + "b,0,0.1,0.2\na,5.013,0.5,0.1\na,5.127,0.6,0.2\na,9.5,0.7,0.3\n"


@pytest.fixture
def folder(tmp_path):
    def write(commands=GOOD, samples=SAMPLES, description=TOML):
        files = {"log.toml": description, "samples.csv": samples, "commands.csv": commands}
        return write_files(tmp_path / "log", files)

    return write


def test_commands_keep_their_own_times_and_poses_their_grid(folder):
    first, second = read_log(folder()).episodes
    np.testing.assert_array_equal(first.issued, [5.013, 5.127, 9.5])
    np.testing.assert_array_equal(first.commands, [[0.5, 0.1], [0.6, 0.2], [0.7, 0.3]])
    np.testing.assert_allclose(first.times, [5.0, 5.1, 5.2, 5.3])
    assert np.isnan(first.poses[:, 0]).tolist() == [False, False, True, False]
    np.testing.assert_array_equal(second.issued, [0.0])


def test_the_command_in_force_at_a_sample_is_the_newest_and_none_is_zero(folder):
    first, second = read_log(folder()).episodes
    np.testing.assert_array_equal(first.held, [[0, 0], [0.5, 0.1], [0.6, 0.2], [0.6, 0.2]])
    np.testing.assert_array_equal(second.held, [[0.1, 0.2]] * 2)


def test_a_log_without_such_a_file_has_its_commands_with_its_samples(folder):
    samples = "episode,time,v,omega,x,y,heading\na,0,1,2,0,0,0\na,0.1,3,4,0,0,0\n"
    home = folder(samples=samples)
    (home / "commands.csv").unlink()
    (episode,) = read_log(home).episodes
    assert episode.issued is None
    np.testing.assert_array_equal(episode.held, [[1, 2], [3, 4]])


@pytest.mark.parametrize("command", [kind for kind in COMMANDS if kind != "none"])
def test_each_kind_of_command_has_columns_of_its_own(folder, command):
    home = folder(GOOD.replace("v,omega", ",".join(COMMANDS[command])), description=TOML.replace("twist", command))
    np.testing.assert_array_equal(read_log(home).episodes[0].commands[0], [0.5, 0.1])


@pytest.mark.parametrize(
    ("commands", "says"),
    [
        ("", "/commands.csv: is empty"),
        (HEADER, "/commands.csv: has no rows"),
        (b"\xff\xfe\x00", "/commands.csv: is not a CSV file"),
        (GOOD.replace("omega", "yaw"), "/commands.csv: line 1: unknown column 'yaw'"),
        (GOOD.replace(",omega", ""), "/commands.csv: line 1: no column 'omega'; commands of kind 'twist' need "),
        (GOOD.replace("0.6,0.2", "0.6"), "/commands.csv: line 4: has 3 cells"),
        (GOOD.replace("0.6,0.2", "0.6,"), "/commands.csv: line 4, column 'omega': must be a finite number, got ''"),
        (GOOD.replace("5.127", "inf"), "/commands.csv: line 4, column 'time': must be a finite number"),
        (GOOD.replace("5.127", "5.013"), "/commands.csv: line 4, column 'time': 5.013 s does not come after"),
        (GOOD.replace("a,", "c,"), "/commands.csv: line 3, column 'episode': 'c' is not in samples.csv"),
        (GOOD.replace("b,0,0.1,0.2\n", ""), "/samples.csv: line 5, column 'episode': 'b' is not in commands.csv"),
        (
            GOOD.replace("b,0,", "b,17,"),
            "/commands.csv: line 2, column 'time': the commands of 'b' lie between 17 and 17",
        ),
        (GOOD + "b,0,0,0\n", "/commands.csv: line 6, column 'episode': 'b' comes back after another episode"),
    ],
)
def test_a_mistake_in_commands_is_one_line_with_file_line_and_column(folder, commands, says):
    assert complaint(folder(commands)).startswith(says)


def test_commands_of_another_clock_are_refused_with_both_times(folder):
    says = complaint(folder(GOOD.replace("a,5.013", "a,1.013").replace("a,5.127", "a,1.2").replace("a,9.5", "a,1.3")))
    assert "lie between 1.013 and 1.3 s, its poses between 5 and 5.3 s; write both in seconds of one clock" in says


def test_commands_in_both_files_are_refused(folder):
    samples = "episode,time,v,omega,x,y,heading\na,5.0,0,0,1,2,0\na,5.1,0,0,1,2,0\n"
    assert complaint(folder(samples=samples)).startswith("/samples.csv: line 1: unknown column 'v'")


def test_duties_beyond_full_are_refused_and_so_are_commands_of_still_frames(folder):
    duty = TOML.replace("twist", "duty")
    says = complaint(folder(GOOD.replace("v,omega", "left,right").replace("0.7,0.3", "0.7,1.3"), description=duty))
    assert says.startswith("/commands.csv: line 5, column 'right': a duty must be between -1 and 1, got 1.3")
    assert "there are no commands" in complaint(folder(description=TOML.replace("twist", "none")))


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    text=st.one_of(
        st.text(max_size=80),
        st.lists(st.text("ab,-0.159einf \n\"'\t", max_size=20), max_size=6).map(lambda rows: HEADER + "\n".join(rows)),
    )
)
def test_no_text_leads_to_anything_but_a_log_or_one_line(tmp_path_factory, text):
    home = tmp_path_factory.getbasetemp() / "fuzz"
    home.mkdir(exist_ok=True)
    for name, content in (("log.toml", TOML), ("samples.csv", SAMPLES), ("commands.csv", text)):
        (home / name).write_text(content, encoding="utf-8", newline="")
    log, problem = read(home)
    assert "\n" not in problem
    assert log is None or all(np.isfinite(episode.commands).all() for episode in log.episodes)


def read(home):
    """The log, or None and what is wrong with it."""
    try:
        return read_log(home), ""
    except LogError as problem:
        return None, str(problem)
