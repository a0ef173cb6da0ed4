import json

import numpy as np
import pytest

from proxytune.cli.main import main
from proxytune.diagnosis import recording as filming
from proxytune.extensions import interrupt
from proxytune.files import shipped
from proxytune.logs import read_log, read_pictures
from proxytune.study import load_family, read_study_settings

MODEL = 'format = 1\nrobot = "duckiebot"\nplant = "planar"\n[effects.camera_roll]\ncamera_roll = 4.0\n'


@pytest.fixture
def words(tmp_path, monkeypatch):
    """The words that record a log of this name, of quickstart."""
    monkeypatch.setattr(filming, "SHORTEST_S", 0.5)
    (tmp_path / "model.toml").write_text(MODEL)
    (tmp_path / "study.toml").write_bytes((shipped("studies") / "quickstart" / "study.toml").read_bytes())
    base = ("record", tmp_path, "--model", tmp_path / "model.toml", "--repeats", "1", "--output")

    def spoken(name, *options):
        length = () if "--commands" in options else ("--seconds", "5")
        return (*base, tmp_path / name, *length, *options)

    return spoken


@pytest.fixture
def recorded(words, answered, tmp_path):
    """The folder of such a log."""

    def run(name, *options):
        answered(*words(name, *options))
        return tmp_path / name

    return run


def test_frames_are_read_as_they_were_taken(words, capsys, tmp_path, refused):
    home = tmp_path / "log"
    assert main([*map(str, words("log", "--frames", "12")), "--json"]) == 0
    out, told = capsys.readouterr()
    assert json.loads(out)["frames"] == 12
    assert "driving: 12 of 12 frames" in told, "a line where there is no terminal"
    log = read_log(home)
    frames = log.frames
    assert (frames.road, frames.position_m, frames.heading_deg, frames.fixed_exposure) == (
        "small_loop",
        0.002,
        pytest.approx(np.degrees(0.005), abs=1e-4),
        True,
    )
    assert [path.name for path in frames.paths] == [f"{number:06d}.png" for number in range(12)]
    assert [log.episodes[drive].name for drive in frames.drives] == [f"lane_{number}" for number in range(12)]
    taken = list(filming.film(load_family(read_study_settings(tmp_path), tmp_path / "model.toml"), 12, 1))
    np.testing.assert_array_equal(read_pictures(frames, range(12)), np.concatenate([drive.pictures for drive in taken]))
    np.testing.assert_allclose(frames.times, np.concatenate([drive.times for drive in taken]), atol=1e-6)
    np.testing.assert_allclose(log.episodes[-1].poses, taken[-1].episode.poses, atol=1e-4)
    assert not list(home.rglob(".*"))
    assert "log: holds a log; give another folder" in refused(*words("log"))
    assert "--frames must be between 0 and 1000000, got -1" in refused(*words("new", "--frames", "-1"))


def test_manoeuvres_are_the_same_with_frames_and_odd_intervals_a_caution(words, answered, recorded, tmp_path, capsys):
    plain, filmed = tmp_path / "plain", recorded("filmed", "--frames", "2")
    assert answered(*words("plain"))["frames"] == 0
    assert (filmed / "samples.csv").read_text().startswith((plain / "samples.csv").read_text())
    assert not (plain / "frames.csv").exists()
    assert "[camera]" not in (plain / "log.toml").read_text()
    assert read_log(plain).frames is None
    assert answered(*words("good"))["cautions"] == []
    (tmp_path / "model.toml").write_text(MODEL + "[effects.trim]\ntrim = { value = 0.2, interval = [0.01, 0.05] }\n")
    assert main([*map(str, words("odd"))]) == 0
    assert capsys.readouterr().out.startswith("beware: ")


def test_a_signal_after_the_drives_leaves_no_log_and_the_same_command_writes_it(words, refused, answered, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("proxytune.api.logs.log_cautions", lambda *known: interrupt(2, None))
        assert "no log was written" in refused(*words("log"), status=130)
    assert answered(*words("log"))["rows"]


@pytest.mark.slow
def test_a_map_of_the_users_own_goes_with_the_log(recorded, tmp_path):
    (tmp_path / "yard.toml").write_bytes((shipped("robots") / "maps" / "small_loop.toml").read_bytes())
    study = tmp_path / "study.toml"
    study.write_text(study.read_text().replace('"small_loop"', '"yard.toml"'))
    home = recorded("log", "--frames", "1")
    assert read_log(home).frames.road == str((home / "yard.toml").resolve())
    assert (home / "yard.toml").read_bytes() == (tmp_path / "yard.toml").read_bytes()


@pytest.mark.parametrize("frames", ["-1", "1000001"])
def test_an_impossible_number_of_frames_is_refused(words, refused, tmp_path, frames):
    assert f"--frames must be between 0 and 1000000, got {frames}" in refused(*words("log", "--frames", frames))
    assert not (tmp_path / "log").exists()


def test_a_picture_that_cannot_be_written_leaves_no_log(recorded, words, capsys):
    home = recorded("log")
    (home / "log.toml").unlink()
    (home / "frames").write_text("in the way")
    capsys.readouterr()
    assert main([*map(str, words("log", "--frames", "1"))]) == 1
    assert "000000.png: the picture cannot be written" in capsys.readouterr().err
    assert not (home / "log.toml").exists()


@pytest.mark.parametrize("frames", [0, 2])
def test_a_recording_begun_again_with_fewer_pictures_is_refused(recorded, words, refused, frames):
    home = recorded("log", "--frames", "3")
    (home / "log.toml").unlink()
    line = refused(*words("log", "--frames", str(frames)))
    assert f"00000{frames}.png: is of an earlier, longer run, and there are now {frames} pictures; give another" in line
    assert not (home / "log.toml").exists()


@pytest.mark.parametrize("kind", ["duty", "twist"])
def test_a_table_of_commands_is_driven_as_it_is(recorded, tmp_path, kind):
    duties = np.repeat([[0.2, 0.4], [0.5, 0.5], [-0.1, 0.1]], 20, axis=0)
    shown = duties
    if kind == "twist":
        shown = np.stack((0.6 * duties.mean(axis=1), 0.6 * (duties[:, 1] - duties[:, 0]) / 0.16), axis=1)
    rows = [f"next,{row / 20.0:.4f},{first:.6f},{second:.6f}" for row, (first, second) in enumerate(shown)]
    header = {"duty": "episode,time,left,right", "twist": "episode,time,v,omega"}[kind]
    (tmp_path / "commands.csv").write_text("\n".join([header, *rows]) + "\n")
    log = read_log(recorded("played", "--commands", tmp_path / "commands.csv", "--repeats", "2"))
    assert [episode.name for episode in log.episodes] == ["0", "1"]
    for episode in log.episodes:
        np.testing.assert_allclose(episode.commands, duties, atol=2e-4)
    assert not np.array_equal(*(episode.poses for episode in log.episodes)), "each has noise of its own"


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("episode,time,a,b\nnext,0,1,1\n", "has no columns of commands; name them as a log does"),
        ("episode,time,left,right\nnext,0,1,1\nnext,1e5,1,1\n", "drive 'next' lasts 100000 s; cut it into drives"),
        (
            "episode,time,throttle,steering\nnext,0,1,1\n",
            "commands.csv: commands of kind 'ackermann' are not for robot",
        ),
        ("episode,time,throttle,steering\nnext,0,1,1\n", "; give duty, wheel_speed or twist, or name another robot"),
        ("episode,time,v,omega\nnext,0,9,1\n", "commands.csv: asks a wheel for 9.08 m/s, more than the robot's full"),
        ("episode,time,v,omega\nnext,0,9,1\n", "; state a higher full_speed in its robot.toml"),
        ("episode,time,left,right\nnext,0,1,nan\n", "column 'right'"),
    ],
)
def test_a_table_that_cannot_be_driven_is_refused_in_one_line(words, refused, tmp_path, table, said):
    (tmp_path / "commands.csv").write_text(table)
    assert said in refused(*words("log", "--commands", tmp_path / "commands.csv"))
    assert not (tmp_path / "log").exists()


def test_a_length_is_not_given_to_drives_of_a_table_which_have_their_own(words, refused, tmp_path):
    told = refused(*words("log", "--commands", tmp_path / "commands.csv", "--seconds", "5"))
    assert "--seconds: is for manoeuvres" in told
