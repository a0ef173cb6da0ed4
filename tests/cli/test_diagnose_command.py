"""`diagnose` from a log's folder to its findings: the JSON of DESIGN.md, files that read back, one-line refusals."""

import json
import re
import shutil
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import hidden_cases as hidden
import numpy as np
import pytest
from planted import CALM, TRUTH, planted_log, with_poses, write_log

from proxytune.cli.main import main
from proxytune.effects import CATALOGUE, read_model
from proxytune.study import open_study

pytestmark = pytest.mark.usefixtures("few_effects")
KEYS = {
    *("verdict", "declared", "effects", "immaterial", "candidates", "residual_depends_on", "error"),
    *("could_not_be_seen", "next_manoeuvre"),
}
ERROR_KEYS = {
    *("horizon_s", "before", "before_interval", "after", "after_interval", "noise_floor", "noise_floor_upper"),
    "unit",
}
SCRUBBING = {**TRUTH, "yaw_scrub": 0.12}


def small_log(**more):
    return planted_log(SCRUBBING, **{"episodes": 6, "seconds": 12.0, "noise": CALM, **more})


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("diagnosed")


@pytest.fixture(scope="module")
def printed(home, few_effects):
    """What was printed, diagnosing a small log once."""
    folder = write_log(small_log(), home / "log")
    with redirect_stdout(StringIO()) as text:
        assert main(["diagnose", str(folder), "--output", str(home / "out"), "--json"]) == 0
    return text.getvalue()


@pytest.fixture(scope="module")
def document(printed):
    return json.loads(printed)


def test_the_document_has_what_the_design_promises_and_every_effect_tried_best_first(document):
    assert set(document) >= KEYS
    assert document["verdict"] == "explained"
    assert set(document["error"]) >= ERROR_KEYS
    assert (document["error"]["horizon_s"], document["error"]["unit"]) == (2.0, "m")
    assert set(document["declared"]) == {"trim", "delay"}
    for estimate in document["declared"].values():
        assert set(estimate) >= {"value", "interval"}
        assert estimate["interval"][0] <= estimate["value"] <= estimate["interval"][1]
    gains = [candidate["held_out_gain"] for candidate in document["candidates"]]
    assert gains == sorted(gains, reverse=True)
    assert all(set(candidate) >= {"name", "held_out_gain", "p_value"} for candidate in document["candidates"])
    names = {candidate["name"] for candidate in document["candidates"]}
    assert {"yaw_scrub", "dead_band", "stiction", "dropped_commands", "delay_jitter"} <= names <= set(CATALOGUE)


def test_the_effect_is_named_with_its_parameter_interval_unit_and_worth(document):
    (effect,) = document["effects"]
    assert effect["name"] == "yaw_scrub"
    assert effect["indistinguishable_from"] == []
    (parameter,) = effect["parameters"].values()
    assert set(effect["parameters"]) == {"baseline"}
    assert parameter["unit"] == "m"
    assert parameter["interval"][0] < parameter["value"] < parameter["interval"][1]
    assert abs(parameter["value"] - 0.12) < np.ptp(parameter["interval"])

    assert set(effect["worth"]) == {"1", "2", "5"}
    for worth in effect["worth"].values():
        assert worth["unit"] == "%"
        assert worth["interval"][0] < worth["value"] < worth["interval"][1]
    assert effect["worth"]["2"]["interval"][0] > 50.0
    assert document["immaterial"] == []


def test_what_is_printed_is_what_is_written_and_the_model_reads_back_with_what_was_found(document, home):
    written = json.loads((home / "out" / "diagnosis.json").read_text())
    files = document["files"]
    assert {key: value for key, value in document.items() if key != "files"} == written
    assert {Path(name).name for name in files} == {path.name for path in (home / "out").iterdir()}
    assert {"diagnosis.json", "model.toml"} <= {Path(name).name for name in files}
    figures = [Path(name) for name in files if name.endswith(".png")]
    assert len(figures) >= 3
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in figures)
    page = (home / "out" / "report.html").read_text(encoding="utf-8")
    said = re.search('<p class="answer">(.*?)</p>', page).group(1)
    assert said.startswith("planted: yaw scrub: the robot turns as if its wheels were 0.1")
    assert " apart; without it predictions over 2 s are " in said
    assert ". Explained: with the effects added, only noise is left (expected false names: at most 0.0" in said
    assert page.count("<figure") == len(figures)
    assert "python -m proxytune diagnose " in page.split("<footer>")[1]
    assert "--json" not in page
    model = read_model(home / "out" / "model.toml")
    (parameter,) = document["effects"][0]["parameters"].values()
    assert model.robot == "duckiebot"
    assert model.theta["yaw_scrub"] == parameter["value"]
    assert model.intervals["yaw_scrub"] == tuple(parameter["interval"])
    assert set(model.theta) >= {"trim", "delay", "yaw_scrub"}


def test_predicting_the_test_drives_with_the_model_reproduces_the_error(document, home, answered):
    log = small_log()
    folder = write_log(replace(log, episodes=log.episodes[2::3]), home / "kept")
    output = home / "kept.csv"
    told = answered("predict", home / "out" / "model.toml", folder, "--output", output)
    assert told["error"]["value"] == pytest.approx(document["error"]["after"], rel=0.15)
    assert told["error"]["value"] < document["error"]["before"]


def test_a_study_takes_the_model_as_its_proxy(printed, home):
    shipped = Path(__file__).parents[2] / "studies" / "known_answer"
    study = home / "study"
    study.mkdir()
    for name in ("target.csv", "truth.toml"):
        shutil.copy(shipped / name, study)
    shutil.copy(home / "out" / "model.toml", study)
    text = (shipped / "study.toml").read_text(encoding="utf-8")
    (study / "study.toml").write_text(text, encoding="utf-8")
    plain = open_study(study)
    (study / "study.toml").write_text(text.replace("format = 1", 'format = 1\nproxy = "model.toml"'), encoding="utf-8")
    extended = open_study(study)
    assert extended.settings.proxy == study / "model.toml"
    assert extended.identity != plain.identity
    chains = [opened.family.instance({}).drivetrain.motion for opened in (plain, extended)]
    assert [{effect.name for effect in chain.effects} for chain in chains] == [set(), {"yaw_scrub"}]


@pytest.mark.slow
def test_an_effect_that_is_declared_is_not_missing_in_another_log_either(home, printed, answered):
    test = write_log(small_log(seed=2), home / "test")
    words = ("--declared", "trim, delay,yaw_scrub", "--test", test, "--output", home / "declared")
    told = answered("diagnose", home / "log", *words)
    assert (told["verdict"], told["effects"]) == ("nothing missing", [])
    assert told["declared"]["yaw_scrub"]["value"] == pytest.approx(0.12, abs=0.01)
    assert told["error"]["after"] == told["error"]["before"]
    assert told["fitted_s"] == pytest.approx(told["tested_s"], rel=0.02)


@pytest.mark.slow
def test_a_robot_of_the_logs_own_geometry_is_diagnosed_and_its_model_predicts(tmp_path, answered):
    log = replace(small_log(), robot="my_robot")
    folder = write_log(log, tmp_path / "log", **{"wheel_radius_m": 0.0318, "baseline_m": 0.16, "full_speed_m_s": 0.6})
    answered("diagnose", folder, "--declared", "trim,delay,motor_lag", "--output", tmp_path / "o")
    model = tmp_path / "o" / "model.toml"
    assert read_model(model).geometry == {"wheel_radius": 0.0318, "effective_baseline": 0.16, "full_speed": 0.6}
    assert answered("predict", model, folder, "--output", tmp_path / "p.csv")["error"]["value"] < 0.02


def changed(change):
    """A log's folder of a changed log."""
    return lambda folder: write_log(change(small_log()), folder)


def with_commands(log, change):
    return replace(log, episodes=tuple(replace(e, commands=change(e.commands)) for e in log.episodes))


def without_commands(folder):
    log = small_log()
    episodes = tuple(replace(e, commands=np.empty((len(e.times), 0))) for e in log.episodes)
    write_log(replace(log, command="none", episodes=episodes), folder)


def still(log):
    random = np.random.default_rng(1)
    return with_poses(log, lambda poses: random.normal(0.0, (0.002, 0.002, 0.005), poses.shape))


BAD = {
    "a log without commands": (without_commands, "has no commands"),
    "fewer than two episodes' worth of data": (
        lambda folder: write_log(small_log(episodes=1, seconds=15.0), folder),
        "at least 20 s",
    ),
    "zero commands": (changed(lambda log: with_commands(log, lambda duties: 0.0 * duties)), "every command is zero"),
    "a stationary robot": (changed(still), "stands still"),
    "no folder": (lambda folder: None, "no such folder"),
}


@pytest.mark.parametrize(("make", "says"), BAD.values(), ids=BAD)
def test_data_that_cannot_bear_an_answer_is_refused_in_one_line_and_nothing_is_written(make, says, tmp_path, refused):
    make(tmp_path / "log")
    line = refused("diagnose", tmp_path / "log", "--output", tmp_path / "out")
    assert line.startswith("proxytune diagnose: ")
    assert says in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--declared", "trimm"], "--declared trimm: no effect on motion has this name"),
        (["--declared", "blur"], "--declared blur: no effect on motion"),
        (["--robot", "duckybot"], "robot 'duckybot' is unknown"),
        (["--seed", "-1"], "--seed must be at least 0"),
        (["--test", "nowhere"], "nowhere: no such folder"),
    ],
)
def test_wrong_options_are_told_in_one_line(words, says, home, printed, refused, tmp_path):
    assert says in refused("diagnose", home / "log", *words, "--output", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_people_read_that_a_clean_log_is_missing_nothing_and_where_the_files_are(tmp_path, capsys):
    folder = write_log(planted_log(TRUTH, episodes=6, seconds=12.0, noise=CALM), tmp_path / "log")
    assert main(["diagnose", str(folder), "--output", str(tmp_path / "out")]) == 0
    out = capsys.readouterr().out
    assert "nothing missing" in out
    assert "model.toml" in out.replace("\n", ""), "a long path is cut into lines"
    told = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert (told["verdict"], told["effects"], told["residual_depends_on"]) == ("nothing missing", [], [])
    assert told["next_manoeuvre"] is None


@pytest.mark.slow
def test_where_the_noise_is_not_known_people_read_what_to_drive(tmp_path, capsys):
    folder = write_log(hidden.make_log(hidden.CLEAN[0], episodes=6, seconds=12.0), tmp_path / "log")
    assert main(["diagnose", str(folder), "--output", str(tmp_path / "out")]) == 0
    out = " ".join(capsys.readouterr().out.split())
    told = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert told["verdict"] == "cannot be told"
    assert told["next_manoeuvre"]["times"] == 10
    assert told["error"]["noise_floor"] < told["error"]["noise_floor_upper"]
    assert 1.0 <= told["error"]["noise_floor_upper"] / told["error"]["after"] < 1.05
    assert "10 times from the same commands" in out
