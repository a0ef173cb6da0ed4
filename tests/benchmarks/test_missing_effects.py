"""The benchmark of missing effects: its format, its scorer, and that truths lie apart from what entries may know."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from missing_effects import learned, models, write
from missing_effects.baselines import BASELINES
from missing_effects.cases import Drive, FormatError, errors, read_case, write_drives, write_poses
from missing_effects.score import main, read_truths, score, table
from rates import GENERATORS, all_jobs
from sklearn.preprocessing import PolynomialFeatures

from proxytune.logs import read_log

SCRIPTS = Path(__file__).resolve().parents[2] / "benchmarks" / "missing_effects"
ROBOT = {
    "drive": "differential",
    "command": "duty",
    "full_speed_m_s": 0.6,
    "baseline_m": 0.16,
    "motor_time_constant_s": 0.2,
    "delay_s": 0.15,
}


def straight(speed, seconds=10.0):
    """Poses (T, 3) of a robot that drives ahead, slanted."""
    way = speed * np.arange(round(seconds * 20) + 1) * 0.05
    return np.stack((0.6 * way, 0.8 * way, np.full_like(way, np.arctan2(0.8, 0.6))), axis=1)


def drive(poses, name="a"):
    times = np.arange(len(poses)) * 0.05
    return Drive(name, times, np.full((len(poses), 2), 0.5), poses)


@pytest.fixture
def folder(tmp_path):
    """Two made-up cases whose robots drive 0.5 m/s: one lacks two effects, the other none."""
    names = dict.fromkeys(("dead_band", "stiction", "trim_b"), "")
    write._write_json(tmp_path / "catalogue.json", {"differential": names})
    for name, missing, kind in (("one", [["dead_band", "stiction"], ["trim_b"]], "pair"), ("two", [], "clean")):
        write._write_json(tmp_path / "cases" / name / "robot.json", ROBOT)
        truth = {"kind": kind, "missing": missing, "floor_m": {"1": 0.01, "2": 0.02, "5": 0.1}}
        write._write_json(tmp_path / "truth" / f"{name}.json", truth)
        write_poses(tmp_path / "truth" / f"{name}.csv", [drive(straight(0.5))], [straight(0.5)])
    return tmp_path


def enter(folder, names, speed=0.55, entry="entry"):
    for case in ("one", "two"):
        write_poses(folder / entry / f"{case}.csv", [drive(straight(speed))], [straight(speed)])
        write._write_json(folder / entry / f"{case}.json", {"effects": names, "seconds": 3.0})
    return folder / entry


def test_an_entry_is_scored_by_hand_also_where_it_names_nothing_and_refused_where_it_is_not_there(folder):
    found = score(enter(folder, ["stiction"]), read_truths(folder))
    assert [(one.named, one.false, one.seconds) for one in found] == [(1, 0, 3.0), (0, 1, 3.0)]
    for one in found:
        assert one.ratios == pytest.approx({1: 5.0, 2: 5.0, 5: 2.5}, rel=1e-3)
    assert "| entry | 1 of 2 | 0.50 | 5.00, 5.00 | 5.00, 5.00 | 2.50, 2.50 | 3.0 |" in table({"entry": found})
    truths = read_truths(folder)
    found = score(enter(folder, None), (replace(truths[0], floor=None), truths[1]))
    assert found[0].ratios is None
    assert "| entry | names none |  | 5.00, 5.00" in table({"entry": found})
    with pytest.raises(FormatError, match="is no folder"):
        score(folder / "nobody", read_truths(folder))
    with pytest.raises(FormatError, match="has no cases"):
        read_truths(folder / "nowhere")


def test_errors_are_seen_from_where_each_window_begins():
    turned = straight(0.5) @ np.array(((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))) + (3.0, 1.0, np.pi / 2.0)
    assert max(errors([turned], [straight(0.5)], 0.05).values()) < 1e-12
    aside = straight(0.5) + (0.0, 0.0, 0.1)
    assert errors([aside], [straight(0.5)], 0.05)[2] == pytest.approx(2.0 * np.sin(0.05), rel=1e-9)


def shorten(file):
    file.write_text("\n".join(file.read_text().splitlines()[:-1]))


def of(text):
    return lambda file: file.write_text(text)


def added(text):
    return lambda file: file.write_text(file.read_text() + text)


def replaced(before, after):
    return lambda file: file.write_text(file.read_text().replace(before, after))


@pytest.mark.parametrize(
    ("file", "spoil", "told"),
    [
        ("two.csv", Path.unlink, "two.csv: is missing"),
        ("two.json", Path.unlink, "two.json: is missing"),
        ("two.csv", shorten, "drive 'a' has 200 poses, 201 are asked for"),
        ("two.csv", replaced("heading", "yaw"), "has no column 'heading'"),
        ("two.csv", replaced("a,9.950", "a,9.960"), "is at 9.96 s, asked for 9.95"),
        ("two.csv", added("b,0,0,0,0\n"), "has a drive 'b' that is not held out"),
        ("two.csv", added("a,0,nan,0,0\n"), "line 203, column 'x': 'nan' is no number"),
        ("two.csv", added("a,0,1e300,0,0\n"), "'1e300' is no number within"),
        ("two.csv", added("a,0\n"), "line 203 has 2 cells"),
        ("two.csv", of(""), "two.csv: is empty"),
        ("two.json", of("{"), "two.json: is not JSON"),
        ("two.json", of('["stiction"]'), "two.json: is no object"),
        ("two.json", of('{"effects": "stiction"}'), "'effects' is no list of names"),
        ("two.json", of('{"effects": ["glue"]}'), "names 'glue', which catalogue.json does not have"),
        ("two.json", of('{"seconds": NaN}'), "'seconds' is no finite number"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_bad_entry_is_refused_in_one_line_that_names_the_file(folder, file, spoil, told, capsys, monkeypatch):
    entry = enter(folder, ["stiction"])
    spoil(entry / file)
    monkeypatch.setattr(sys, "argv", ["score.py", str(folder), str(entry)])
    assert main() == 2
    out, said = capsys.readouterr()
    assert (out, said.count("\n")) == ("", 1)
    assert said.startswith("error: ")
    assert file in said
    assert told in said


@pytest.mark.parametrize("generator", [name for name, cases in GENERATORS.items() if not hasattr(cases, "PHYSICS")])
def test_a_case_is_what_its_generator_measured_and_keeps_its_truth_apart(generator, tmp_path):
    job = next(job for job in all_jobs(1, generator) if job.kind == "in form")
    write.write_case(tmp_path, "case", job, drives=2, seconds=6.0)
    case = read_case(tmp_path / "cases" / "case")
    log = GENERATORS[generator].make_log(job.case, episodes=2, seconds=6.0)
    read = read_log(case.folder / "log")
    assert (read.command, read.rate_hz) == (log.command, log.rate_hz)
    for ours, theirs, made in zip(case.drives, read.episodes, log.episodes, strict=True):
        np.testing.assert_allclose(ours.poses, made.poses, atol=1e-6)
        np.testing.assert_allclose(theirs.commands, made.commands, atol=1e-6)
    assert len(case.held_out) == write.DRIVES_HELD_OUT
    for one in case.held_out:
        assert np.isfinite(one.poses[0]).all()
        assert np.isnan(one.poses[1:]).all()
        assert not any(np.array_equal(one.commands, other.commands) for other in case.drives)
    assert job.case.name not in "".join(path.read_text() for path in (tmp_path / "cases").rglob("*") if path.is_file())
    truth = json.loads((tmp_path / "truth" / "case.json").read_text())
    assert truth["missing"] == [list(names) for names in job.right]
    assert set(truth["floor_m"]) == {"1", "2", "5"}


def test_the_catalogue_has_every_name_that_is_right_somewhere_and_none_that_is_declared():
    known = {"differential": set(), "ackermann": set()} | {d: set(names) for d, names in write.catalogue().items()}
    for generator in GENERATORS:
        drives = "ackermann" if "car" in generator else "differential"
        right = {name for job in all_jobs(1, generator) for names in job.right for name in names}
        assert right <= known[drives] | {"delay"}, generator
    assert not {"trim", "delay", "camera_pitch", "blur"} & known["differential"]
    assert all(write.catalogue()["differential"].values())


def test_more_cases_of_a_seed_begin_with_the_same_and_kinds_and_generators_take_turns():
    few, more = (write.drawn(count, ("first", "second"), 1) for count in (10, 20))
    assert more[:10] == few
    assert few != write.drawn(10, ("first", "second"), 2)
    assert [job.kind for job in few] == list(write.KINDS) * 2
    assert [job.generator for job in few] == ["first"] * 5 + ["second"] * 5


def test_the_textbook_model_drives_a_circle_and_its_fit_finds_what_was_changed():
    duties = np.random.default_rng(1).uniform(-0.2, 0.9, (3, 30, 2)).repeat(10, axis=1)
    blank = [replace(drive(np.zeros((300, 3)), str(n)), commands=one) for n, one in enumerate(duties)]
    true = models.nominal(ROBOT) | {"trim": 0.05, "gain": 0.9, "lag": 0.3}
    driven = [replace(one, poses=models.poses_of(models.twists(ROBOT, true, one), np.zeros(3), 0.05)) for one in blank]
    found = models.fit(ROBOT, driven)
    assert found.figures == pytest.approx(true, abs=2e-3)
    assert {"trim", "gain", "lag"} <= found.other
    circle = models.poses_of(np.tile((0.3, np.pi / 5.0), (200, 1)), np.zeros(3), 0.05)
    np.testing.assert_allclose(circle[-1], (0.0, 0.0, 2.0 * np.pi), atol=1e-9)
    np.testing.assert_allclose(models.measured_twists(drive(circle), 4), [(0.3, np.pi / 5.0)] * 197, atol=1e-9)


def test_polynomials_have_the_order_of_the_library_whose_slopes_they_are_multiplied_by():
    speeds, commands = np.random.default_rng(2).normal(size=(2, 5, 2))
    terms = PolynomialFeatures(2).fit_transform(np.concatenate((speeds, commands), axis=1))
    np.testing.assert_allclose(learned.quadratic(speeds, commands), terms)


def test_cases_read_back_as_they_were_written(tmp_path):
    poses = straight(0.5)
    poses[3] = np.nan
    write_drives(tmp_path / "log" / "samples.csv", [drive(poses)], ("left", "right"))
    write_drives(tmp_path / "held_out" / "samples.csv", [drive(straight(0.4), "b")], ("left", "right"))
    write._write_json(tmp_path / "robot.json", ROBOT)
    case = read_case(tmp_path)
    np.testing.assert_allclose(case.drives[0].poses, poses, atol=1e-6)
    assert case.held_out[0].name == "b"
    assert case.robot == ROBOT


@pytest.mark.slow
def test_a_real_case_goes_through_write_two_entries_and_score(tmp_path):
    def run(script, *words):
        done = subprocess.run([sys.executable, str(SCRIPTS / script), *map(str, words)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    run("write.py", tmp_path, "--cases", 1, "--generators", "first")
    entries = tmp_path / "entries"
    run("baselines.py", tmp_path, entries, "--baselines", "nominal,proxytune")
    text = run("score.py", tmp_path, entries / "nominal", entries / "proxytune")
    ours, theirs = (score(entries / name, read_truths(tmp_path))[0] for name in ("proxytune", "nominal"))
    assert (ours.named, ours.false) == (1, 0)
    assert ours.ratios[2] < 1.2 < theirs.ratios[2]
    assert "| nominal | names none |" in text
    assert set(BASELINES) >= {"nominal", "proxytune"}
