"""A diagnosis from Python: what is found, as tables, figures and files, and errors in Python's words."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

sys.path.append(str(Path(__file__).parent.parent / "diagnosis"))

from planted import CALM, TRUTH, planted_log

from proxytune import InputError, diagnose
from proxytune.effects import read_model
from proxytune.errors import LogError


@pytest.fixture(scope="module")
def planted():
    """A log of a robot whose effective baseline nobody declared."""
    return planted_log({**TRUTH, "yaw_scrub": 0.12}, episodes=4, seconds=12.0, noise=CALM)


@pytest.fixture(scope="module")
def report(planted):
    return diagnose(planted)


def test_the_planted_effect_is_found_with_its_value(report):
    assert (report.verdict, report.effects) == ("explained", ("yaw_scrub",))
    row = report.parameters().loc["yaw_scrub"]
    assert row.low < row.value < row.high
    assert abs(row.value - 0.12) < row.high - row.low
    assert row.unit == "m"
    assert np.isnan(row.before)
    assert repr(report) == "DiagnosisReport of planted: explained: with the effects added, only noise is left"


def test_the_errors_are_those_of_the_document_by_horizon(report):
    errors = report.errors()
    assert list(errors.index) == [1.0, 2.0, 5.0]
    for one in report.document()["errors"]:
        row = errors.loc[one["horizon_s"]]
        assert (row.before, row.after, row.noise_floor) == (one["before"], one["after"], one["noise_floor"])
    assert (errors.after < 0.2 * errors.before).all()


def test_what_is_found_is_drawn_and_written_as_the_command_does(report, tmp_path):
    assert all(isinstance(figure, Figure) for figure in report.figures().values())
    paths = report.write(str(tmp_path / "found"))
    assert [path.name for path in paths] == [
        "diagnosis.json",
        "model.toml",
        *(f"{name}.png" for name in report.figures()),
        "report.html",
    ]
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
    with pytest.raises(InputError, match=words) as problem:
        diagnose(planted, **options)
    assert "\n" not in str(problem.value)
    assert "--" not in str(problem.value)


def test_a_robot_that_nobody_knows_is_asked_for_by_its_argument(planted):
    with pytest.raises(LogError, match="state wheel_radius_m and baseline_m.*or name a robot with robot=") as problem:
        diagnose(replace(planted, robot="unheard_of"))
    assert "--robot" not in str(problem.value)


def test_a_folder_that_is_no_log_is_refused(tmp_path):
    with pytest.raises(LogError, match="no such folder; check the path"):
        diagnose(str(tmp_path / "nowhere"))
