"""A diagnosis of frames from Python: the camera's figures beside those of motion, and errors in Python's words."""

import json

import pytest
from pictured import lane_poses, write_still_frames

from proxytune import InputError, diagnose, read_log


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    theta = {"camera_pitch": 19.15, "camera_roll": 4.0}
    return write_still_frames(tmp_path_factory.mktemp("rolled") / "log", theta, lane_poses(30), columns=96)


@pytest.fixture(scope="module")
def report(folder):
    return diagnose(read_log(folder))


def test_the_camera_speaks_where_there_is_no_motion(report):
    assert (report.verdict, report.effects) == ("explained", ("camera_roll",))
    assert report.diagnosis is None
    assert report.camera.verdict == "explained"
    assert repr(report).startswith("DiagnosisReport of pictured: camera: explained: ")


def test_parameters_and_errors_are_those_of_the_document(report):
    camera = report.document()["camera"]
    row = report.parameters().loc["camera_roll"]
    told = camera["effects"][0]["parameters"]["camera_roll"]
    assert (row.value, [row.low, row.high], row.unit) == (told["value"], told["interval"], "deg")
    errors = report.camera_errors()
    assert errors.loc["markings", "after"] == camera["error"]["after"] < errors.loc["markings", "before"]
    assert errors.loc["brightness", "before"] == camera["grey_error"]["before"]
    assert list(errors.unit) == ["px", "grey levels"]
    assert report.errors().empty


@pytest.mark.slow
def test_what_is_written_is_what_is_said(report, tmp_path):
    paths = report.write(tmp_path / "found")
    assert json.loads(paths[0].read_text()) == json.loads(json.dumps(report.document()))
    assert {path.stem for path in paths[2:]} == {*report.figures(), "report"}
    assert any("camera_roll" in note for note in report.notes)


def test_errors_are_in_python_s_words(folder):
    with pytest.raises(InputError, match="^declared: camera_rol: .*did you mean 'camera_roll'") as problem:
        diagnose(folder, declared=["camera_rol"])
    assert "--" not in str(problem.value)
    with pytest.raises(InputError, match="^test: pictured has no commands"):
        diagnose(folder, test=folder)
