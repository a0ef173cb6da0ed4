"""Ctrl-C in the middle of what a command writes: what its line says of files is true, and no draft is left."""

import signal
from pathlib import Path

import foreign_robot
import pytest
from pictured import lane_poses, write_still_frames

from proxytune.cli.main import COMMANDS, main
from proxytune.files import shipped
from proxytune.report import writing

TABLE = "agent,episode,distance\n" + "".join(f"{agent},{k},{k + i}\n" for i, agent in enumerate("ABC") for k in (1, 2))
MODEL = 'format = 1\nrobot = "duckiebot"\nplant = "planar"\n[effects.trim]\ntrim = 0.05\n'


@pytest.fixture
def ctrl_c(monkeypatch):
    """Press Ctrl-C in the middle of writing the file of this number."""
    real, begun = writing.write_whole, []

    def at(number):
        def write_whole(path, write, **how):
            begun.append(path)

            def half(draft):
                draft.write_bytes(b"half")
                signal.raise_signal(signal.SIGINT)

            real(path, half if len(begun) == number else write, **how)

        monkeypatch.setattr(writing, "write_whole", write_whole)

    return at


@pytest.fixture
def interrupted(capsys):
    """A command ends with its own line and leaves no draft; the files there are."""

    def run(folder, *words):
        assert main(list(map(str, words))) == 130
        last = capsys.readouterr().err.splitlines()[-1]
        assert last == f"proxytune {words[0]}: interrupted; {COMMANDS[words[0]].left}"
        files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
        assert not [name for name in files if Path(name).name.startswith(".")]
        return files

    return run


@pytest.mark.slow
def test_plot_leaves_every_file_the_old_or_the_new_one(finished, interrupted, ctrl_c):
    assert main(["plot", str(finished)]) == 0
    files = [*(finished / "figures").iterdir(), finished / "report.html"]
    for path in files:
        path.write_bytes(b"old")
    ctrl_c(3)
    interrupted(finished, "plot", finished)
    contents = [path.read_bytes() for path in files]
    assert contents.count(b"old") == len(files) - 2
    assert all(content == b"old" or content.startswith(b"\x89PNG") for content in contents)


def test_score_leaves_whole_figures_alone(tmp_path, interrupted, ctrl_c):
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "b.csv").write_text(TABLE)
    ctrl_c(2)
    both = ("--proxy", tmp_path / "a.csv", "--target", tmp_path / "b.csv", "--metric", "distance:max")
    files = interrupted(tmp_path, "score", *both, "--output", tmp_path / "out", "--table", tmp_path / "t.csv")
    assert files == {"a.csv", "b.csv", "out/scatter.png"}
    assert (tmp_path / "out" / "scatter.png").read_bytes().startswith(b"\x89PNG")


def test_export_leaves_nothing(tmp_path, interrupted, ctrl_c):
    (tmp_path / "model.toml").write_text(MODEL)
    ctrl_c(1)
    words = ("export", tmp_path / "model.toml", "--to", "ros", "--output", tmp_path / "out.yaml")
    assert interrupted(tmp_path, *words) == {"model.toml"}


def test_measure_leaves_the_old_table(make_study, tmp_path, interrupted, monkeypatch):
    folder = make_study()
    (tmp_path / "model.toml").write_text("trim = 0.1\ndelay = 0.12\n")
    (tmp_path / "out.csv").write_text("old")
    monkeypatch.setattr(Path, "replace", lambda self, target: signal.raise_signal(signal.SIGINT))
    words = ("measure", folder, "--model", tmp_path / "model.toml", "--output", tmp_path / "out.csv")
    assert "out.csv" in interrupted(tmp_path, *words)
    assert (tmp_path / "out.csv").read_text() == "old"


def test_new_and_list_leave_nothing(tmp_path, interrupted, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Path, "replace", lambda self, target: signal.raise_signal(signal.SIGINT))
    assert interrupted(tmp_path, "new", "family", "rovers") == set()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("proxytune.cli.listing.robot_names", lambda here: signal.raise_signal(signal.SIGINT))
    assert interrupted(tmp_path, "list", "robots") == set()


def test_import_leaves_nothing(tmp_path, interrupted, monkeypatch):
    source = foreign_robot.write_form(tmp_path, "csv", [foreign_robot.drive(0, seconds=20.0)])
    before = {path.name for path in tmp_path.iterdir()}
    monkeypatch.setattr("proxytune.importing.reading.read_log", lambda draft: signal.raise_signal(signal.SIGINT))
    figures = [word for key, value in foreign_robot.FIGURES.items() for word in ("--figure", f"{key}={value}")]
    interrupted(tmp_path, "import", source, tmp_path / "log", *figures)
    assert {path.name for path in tmp_path.iterdir()} == before


def test_record_leaves_no_log_but_pictures(tmp_path, interrupted, ctrl_c, monkeypatch):
    monkeypatch.setattr("proxytune.diagnosis.recording.SHORTEST_S", 0.5)
    (tmp_path / "study.toml").write_text((shipped("studies") / "quickstart" / "study.toml").read_text(encoding="utf-8"))
    (tmp_path / "model.toml").write_text(MODEL)
    ctrl_c(7)
    options = ("--repeats", "1", "--seconds", "5", "--frames", "4", "--output", tmp_path / "log")
    files = interrupted(tmp_path, "record", tmp_path, "--model", tmp_path / "model.toml", *options)
    assert "log/log.toml" not in files
    assert len([name for name in files if name.startswith("log/frames/")]) == 4


def test_predict_leaves_no_table_but_pictures(tmp_path, interrupted, ctrl_c):
    log = write_still_frames(tmp_path / "log", {}, lane_poses(12), columns=80)
    (tmp_path / "model.toml").write_text(MODEL)
    ctrl_c(13)
    files = interrupted(tmp_path, *("predict", tmp_path / "model.toml", log, "--frames", "--output", tmp_path / "out"))
    assert "out/frames.csv" not in files
    assert len([name for name in files if name.startswith("out/frames/")]) == 12
