"""`import` lists what a source holds, writes a log that reads back, and complains in one line."""

from dataclasses import replace

import foreign_robot
import pytest
from planted import look_for_few

from proxytune.cli.main import main
from proxytune.logs import read_log

FIGURES = [word for key, value in foreign_robot.FIGURES.items() for word in ("--figure", f"{key}={value}")]


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    drives = [foreign_robot.drive(number, seconds=20.0, offset_s=-0.25) for number in range(2)]
    return foreign_robot.write_form(tmp_path_factory.mktemp("source"), "csv", drives)


def test_importing_without_output_lists_what_there_is_and_writes_none(answered, table, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    found = answered("import", table)
    assert found["log"] is None
    assert found["form"].startswith("folder of")
    assert {one["name"]: one["role"] for one in found["channels"]}["yaw_deg"] == "heading"
    assert [one["name"] for one in found["drives"]] == ["run0", "run1"]
    assert list(tmp_path.iterdir()) == []
    assert main(["import", str(table)]) == 0
    text = capsys.readouterr().out
    for part in ("yaw_deg", "heading", "run1", "answers after", "give OUTPUT to write the log"):
        assert part in text


def test_the_log_reads_back_as_given_also_in_the_folder_that_one_is_in(answered, table, tmp_path, monkeypatch):
    words = (str(table), str(tmp_path / "log"), "--robot", "nobodys", *FIGURES, "--clock-offset", "-0.25")
    assert answered("import", *words)["log"] == str(tmp_path / "log")
    log = read_log(tmp_path / "log")
    assert (log.robot, log.command, log.clock_offset_s, len(log.episodes)) == ("nobodys", "twist", -0.25, 2)
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    answered("import", table, ".", "--robot", "nobodys", *FIGURES)
    assert read_log(tmp_path / "empty").name == "empty"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--columns", "x"), "--columns x: write OURS=THEIRS"),
        (("--clock-offset", "soon"), "--clock-offset soon: give seconds"),
        (("--figure", "width=2"), "--figure width=2: write one of"),
        (("--map", "small_loop"), "--map is the map that pictures show, and it has none; leave that out"),
        (("--columns", "x=nowhere:mm"), "no column 'nowhere'"),
        (("--columns", "x=pos_x_mm:inch"), "inch"),
        (("--clock-offset", "nan"), "--clock-offset"),
        (("--figure", "baseline_m=nan"), "--figure"),
        (("--figure", "baseline_m=-1"), "--figure"),
    ],
)
def test_a_wrong_option_is_one_line_and_nothing_is_written(refused, table, tmp_path, words, says):
    assert says in refused("import", table, tmp_path / "log", *words)
    assert not (tmp_path / "log").exists()


def test_the_same_import_again_is_no_error_as_after_a_kill_at_the_very_end(answered, refused, table, tmp_path):
    words = "import", table, tmp_path / "log"
    assert answered(*words) == answered(*words)
    (tmp_path / "log" / "samples.csv").write_text("edited")
    refused(*words)


@pytest.mark.parametrize(("columns", "robot"), [("throttle,steering", "duckiebot"), ("left,right", "car")])
def test_a_table_of_the_other_kind_of_drive_is_refused_before_anything_is_written(refused, tmp_path, columns, robot):
    rows = "".join(f"{k / 20},{k / 100},0,0,0.3,0.0\n" for k in range(200))
    (tmp_path / "drive.csv").write_text(f"time,x,y,heading,{columns}\n{rows}")
    said = refused("import", tmp_path / "drive.csv", tmp_path / "log", "--robot", robot)
    assert f"are not for robot '{robot}'" in said
    assert not (tmp_path / "log").exists()


@pytest.fixture
def model(tmp_path):
    text = (
        'format = 1\nrobot = "nobodys"\n[geometry]\nwheel_radius_m = 0.033\nbaseline_m = 0.16\nfull_speed_m_s = 0.5\n'
    )
    effects = "[effects.dead_band]\nwidth = 0.06\n[effects.motor_lag]\ntime_constant = 0.12\n"
    gains = "[effects.wheel_gain]\nleft = 0.95\nright = 1.0\n[effects.delay]\ndelay = 0.06\n"
    (tmp_path / "model.toml").write_text(text + effects + gains, encoding="utf-8")
    return tmp_path / "model.toml"


def test_predict_takes_a_table_as_it_is_at_its_poses_own_times(answered, model, tmp_path):
    home = foreign_robot.write_form(tmp_path, "csv", [foreign_robot.drive(5, seconds=20.0)])
    assert answered("predict", model, home / "run0.csv", "--output", tmp_path / "poses.csv")["error"]["value"] < 0.0035


@pytest.mark.slow
def test_diagnose_takes_a_folder_of_tables_and_names_what_the_robot_has(answered, tmp_path, monkeypatch):
    look_for_few(monkeypatch, "wheel_gain")
    monkeypatch.chdir(tmp_path)
    drives = [foreign_robot.drive(100 + number, seconds=20.0, offset_s=-0.25) for number in range(3)]
    found = answered("diagnose", foreign_robot.write_form(tmp_path, "csv", drives), "--robot", "nobodys", *FIGURES)
    assert {"dead_band", "wheel_gain", "motor_lag"} <= {effect["name"] for effect in found["effects"]}
    assert {effect["name"] for effect in found["effects"]} <= {"dead_band", "wheel_gain", "motor_lag", "delay"}
    assert found["clocks"]["offset_s"] == pytest.approx(-0.24, abs=0.02)
    assert any("two clocks" in note for note in found["imported"])


@pytest.mark.slow
def test_axes_in_a_mirror_and_a_wheel_in_millimetres_are_cautions(capsys, answered, tmp_path):
    drives = [foreign_robot.drive(number, seconds=20.0) for number in range(2)]
    mirrored = [replace(one, poses=one.poses * (1.0, -1.0, 1.0)) for one in drives]
    source = str(foreign_robot.write_form(tmp_path, "csv", mirrored))
    figures = ["--figure", "wheel_radius_m=31.8", "--figure", "baseline_m=0.2"]
    for words in ((source,), (source, str(tmp_path / "log"))):
        wheel, axes, *_ = answered("import", *words, *figures)["cautions"]
        assert "its wheel_radius is 31.8 m" in wheel
        assert axes.startswith("places are mirrored against headings")
    assert main(["import", source, *figures]) == 0
    assert "- beware: places are mirrored against headings" in capsys.readouterr().out


def test_options_may_stand_before_and_after_the_output(capsys, answered, table, tmp_path):
    before, after, options = tmp_path / "before", tmp_path / "after", ("--robot", "nobodys", *FIGURES)
    assert answered("import", table, *options, after)["log"] == str(after)
    assert answered("import", table, before, *options)["log"] == str(before)
    with pytest.raises(SystemExit):
        main(["import", str(table), "--robot", "nobodys", "a", "b"])
    assert "unrecognized arguments: b" in capsys.readouterr().err
