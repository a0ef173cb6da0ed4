"""A diagnosis from Python, of drives and of frames, and a log from DataFrames: errors are in Python's words."""

import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from one_line import complaint_of
from planted import CALM, TRUTH, planted_log, write_log

from proxytune.api import log_of
from proxytune.api.diagnosis import diagnose
from proxytune.effects import read_model
from proxytune.logs import read_log


@pytest.fixture(scope="module")
def planted():
    """A log of a robot whose effective baseline nobody declared."""
    return planted_log({**TRUTH, "yaw_scrub": 0.12}, episodes=4, seconds=12.0, noise=CALM)


@pytest.mark.slow
def test_what_is_found_is_told_drawn_and_written_as_the_command_does(planted, few_effects, tmp_path):
    report = diagnose(planted)
    assert (report.verdict, report.effects) == ("explained", ("yaw_scrub",))
    row = report.parameters().loc["yaw_scrub"]
    assert row.low < row.value < row.high
    assert abs(row.value - 0.12) < row.high - row.low
    assert row.unit == "m"
    assert np.isnan(row.before)
    said = repr(report)
    assert said.startswith("DiagnosisReport of planted: yaw scrub: the robot turns as if its wheels were 0.1")
    assert ". Explained: with the effects added, only noise is left (expected false names: at most 0.0" in said
    errors = report.errors()
    assert list(errors.index) == [1.0, 2.0, 5.0]
    for one in report.document()["errors"]:
        row = errors.loc[one["horizon_s"]]
        assert (row.before, row.after, row.noise_floor) == (one["before"], one["after"], one["noise_floor"])
    assert (errors.after < 0.2 * errors.before).all()
    assert all(isinstance(figure, Figure) for figure in report.figures().values())
    paths = report.write(str(tmp_path / "found"))
    names = ["diagnosis.json", "model.toml", *(f"{name}.png" for name in report.figures()), "report.html"]
    assert [path.name for path in paths] == names
    assert json.loads(paths[0].read_text()) == json.loads(json.dumps(report.document()))
    assert read_model(paths[1]).theta["yaw_scrub"] == pytest.approx(report.parameters().value["yaw_scrub"])
    assert any("yaw_scrub" in note for note in report.notes)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"declared": ["trimm"]}, "^declared: trimm: no effect on motion has this name; did you mean 'trim'"),
        ({"robot": "duckybot"}, "robot 'duckybot'.* did you mean 'duckiebot'|'duckybot'"),
        ({"effects": ["nobodys:Slip"]}, "effect 'nobodys:Slip': no module 'nobodys'"),
        ({"seed": -1}, "seed must be at least 0, got -1"),
    ],
)
def test_options_that_cannot_be_used_are_one_line_in_python_s_words(planted, options, words):
    told = complaint_of(diagnose, planted, **options)
    assert re.search(words, told)
    assert "--" not in told


def test_a_robot_that_nobody_knows_is_asked_for_by_its_argument_and_what_is_no_folder_refused(planted, tmp_path):
    told = complaint_of(diagnose, replace(planted, robot="unheard_of"))
    assert re.search("state wheel_radius_m and baseline_m.*or name a robot with robot=", told)
    assert "--robot" not in told
    assert "no such folder; check the path" in complaint_of(diagnose, str(tmp_path / "nowhere"))


@pytest.mark.slow
def test_the_camera_speaks_where_there_is_no_motion(rolled_frames, tmp_path):
    report = diagnose(read_log(rolled_frames))
    assert (report.verdict, report.effects, report.diagnosis) == ("explained", ("camera_roll",), None)
    assert report.camera.verdict == "explained"
    assert repr(report).startswith("DiagnosisReport of pictured: camera: camera roll: the camera is tilted by 4.")
    camera = report.document()["camera"]
    row = report.parameters().loc["camera_roll"]
    told = camera["effects"][0]["parameters"]["camera_roll"]
    assert (row.value, [row.low, row.high], row.unit) == (told["value"], told["interval"], "deg")
    errors = report.camera_errors()
    assert errors.loc["markings", "after"] == camera["error"]["after"] < errors.loc["markings", "before"]
    assert errors.loc["brightness", "before"] == camera["grey_error"]["before"]
    assert list(errors.unit) == ["px", "grey levels"]
    assert report.errors().empty
    paths = report.write(tmp_path / "found")
    assert json.loads(paths[0].read_text()) == json.loads(json.dumps(report.document()))
    assert {path.stem for path in paths[2:]} == {*report.figures(), "report"}
    assert any("camera_roll" in note for note in report.notes)


def test_errors_are_in_python_s_words(rolled_frames):
    told = complaint_of(diagnose, rolled_frames, declared=["camera_rol"])
    assert re.match("declared: camera_rol: .*did you mean 'camera_roll'", told)
    assert "--" not in told
    assert complaint_of(diagnose, rolled_frames, test=rolled_frames).startswith("test: pictured has no commands")


DESCRIPTION = {"robot": "duckiebot", "command": "duty", "rate_hz": 20}


@pytest.fixture(scope="module")
def folder_of_logs(tmp_path_factory):
    log = planted_log(TRUTH, episodes=4, seconds=5.0, noise=CALM)
    return write_log(log, tmp_path_factory.mktemp("logs") / "planted")


@pytest.fixture(scope="module")
def samples(folder_of_logs):
    return pd.read_csv(folder_of_logs / "samples.csv", dtype={"episode": str})


def same(one, other):
    """Whether two logs hold the same."""
    described = [(log.name, log.robot, log.command, log.rate_hz, len(log.episodes)) for log in (one, other)]
    return described[0] == described[1] and all(
        np.array_equal(getattr(a, field), getattr(b, field), equal_nan=True)
        for a, b in zip(one.episodes, other.episodes, strict=True)
        for field in ("times", "commands", "poses")
    )


def test_a_log_of_dataframes_is_the_log_of_the_files_however_they_are_indexed(folder_of_logs, samples):
    assert same(log_of(samples, {**DESCRIPTION, "name": "planted"}), read_log(str(folder_of_logs)))
    assert log_of(samples, DESCRIPTION).name == "log"
    description = {**DESCRIPTION, "rate_hz": np.int64(20)}
    assert same(log_of(samples.set_index(["episode", "time"]), description), log_of(samples, DESCRIPTION))


def test_commands_may_have_times_of_their_own_and_their_faults_name_them(samples):
    poses, commands = samples.drop(columns=["left", "right"]), samples[["episode", "time", "left", "right"]]
    log = log_of(poses, DESCRIPTION, commands.assign(time=commands.time + 0.01))
    assert np.allclose(log.episodes[0].issued, log.episodes[0].times + 0.01)
    commands = samples[["episode", "time", "left", "right"]]
    poses = samples.drop(columns=["left", "right"])
    told = complaint_of(log_of, poses, DESCRIPTION, spoilt(5, "left", 2.0)(commands))
    assert told.startswith("commands: row 5, column 'left': a duty must be")
    told = complaint_of(log_of, poses, DESCRIPTION, commands[commands.episode != "03"])
    assert "'03' is not in commands; add its commands" in told


def spoilt(row, column, value):
    def spoil(samples):
        frame = samples.astype({column: object})
        frame.loc[row, column] = value
        return frame

    return spoil


WRONG = {
    "a word": (spoilt(7, "x", "far"), {}, "samples: row 7, column 'x': must be a finite number, or empty .* got 'far'"),
    "a duty": (spoilt(0, "left", 50.0), {}, "samples: row 0, column 'left': a duty must be between -1 and 1, got 50"),
    "time": (spoilt(3, "time", 0.0), {}, "samples: row 3, column 'time': 0 s does not come after 0.1 s"),
    "a column more": (lambda samples: samples.assign(z=0), {}, "samples: unknown column 'z'"),
    "a column less": (lambda samples: samples.drop(columns="y"), {}, "samples: no column 'y'"),
    "no rows": (lambda samples: samples.head(0), {}, "samples: has no rows; add one per sample"),
    "no table": (lambda samples: [1, 2], {}, "samples: must be a DataFrame, got list"),
    "no text": (lambda samples: samples, {"name": None}, "log.toml: .*; give texts and numbers"),
    "a key": (lambda samples: samples, {"rate": 20}, "log.toml: rate: unknown key; did you mean 'rate_hz'"),
    "a command": (lambda samples: samples, {"command": "duties"}, "log.toml: command: unknown value 'duties'"),
}


@pytest.mark.parametrize(("spoil", "keys", "words"), WRONG.values(), ids=WRONG)
def test_what_is_no_log_is_one_line_with_row_and_column(samples, spoil, keys, words):
    assert re.match(words, complaint_of(log_of, spoil(samples), {**DESCRIPTION, **keys}))
