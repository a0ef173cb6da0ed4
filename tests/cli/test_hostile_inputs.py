"""Inputs that nobody means: one line, at once, and never a number that is none."""

import warnings

import foreign_robot
import pytest
from blank import blank
from tiny_loop import TWIN, write_tiny

from proxytune.cli.main import main
from proxytune.report.writing import file_names

FIGURES_DRAWN = True  # see conftest.py
TABLE = "agent,episode,d\n" + "".join(f"{a},{e},{i + 0.1 * e}\n" for i, a in enumerate("ABC") for e in (0, 1))


@pytest.fixture
def table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.csv").write_text(TABLE)
    (tmp_path / "again.csv").symlink_to("t.csv")
    return ("score", "--proxy", "again.csv", "--target", "t.csv", "--metric")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--resamples", "10000000"], "resamples must be between 100 and 1000000"),
        (["--beta", "d:1e308"], "weight of 'd': must be zero to 1e+70, got 1e+308"),
    ],
)
def test_score_refuses_what_would_take_for_ever_or_overflow(table, refused, words, says):
    assert says in refused(*table, "d:max", *words)


@pytest.mark.parametrize("metric", [r"$\frac$", pytest.param("p" * 500, marks=pytest.mark.slow)])
def test_names_are_drawn_as_they_are_and_without_a_word(table, tmp_path, capsys, metric):
    text = TABLE.replace("A,", "a$b$,").replace("B,", "tab\x01le,").replace("C,", f"{metric},")
    (tmp_path / "t.csv").write_text(text.replace("d\n", f"{metric}\n", 1))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main([*table, f"{metric}:max", "--output", "F", "--resamples", "100"]) == 0
    assert capsys.readouterr().err == ""


def test_names_that_are_alike_in_file_names_have_files_of_their_own(table, tmp_path, answered, monkeypatch):
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", blank)
    assert file_names(["a b", "a/b", "a_b_2", "c"]) == {"a b": "a_b", "a/b": "a_b_2", "a_b_2": "a_b_2_2", "c": "c"}
    lines = TABLE.splitlines()
    both = [f"{domain},{line}" for domain in ("a b", "a/b") for line in lines[1:]]
    (tmp_path / "both.csv").write_text("\n".join([f"domain,{lines[0]}", *both]) + "\n")
    proxies = ["--proxy", "both.csv:a b", "--proxy", "both.csv:a/b"]
    words = ["score", *proxies, "--target", "t.csv", "--metric", "d:max", "--resamples", "100"]
    figures = answered(*words, "--output", "F")["figures"]
    assert len(figures) == len(set(figures)) == 6 == len(list((tmp_path / "F").glob("*.png")))


def test_scores_whose_squares_are_no_numbers_are_refused_or_have_no_spread(table, tmp_path, refused, answered):
    (tmp_path / "t.csv").write_text(TABLE.replace("0.1\n", "1e99\n", 1))
    assert "got '1e99'; give it in another unit" in refused(*table, "d:max")
    rows = [f"{agent},{number}e-320" for number, agent in enumerate("ABCD", start=1)]
    (tmp_path / "t.csv").write_text("\n".join(["agent,d", *rows]) + "\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert answered(*table, "d:max", "--resamples", "100")["prpv"] is not None


ENDLESS = {
    "record": (["--model", "m.toml", "--output", "log", "--repeats", "1000000000"], "--repeats must be between 1 and"),
    "measure": (["--model", "m.toml", "--output", "t.csv", "--repeats", "1" + "0" * 12], "--repeats must be between"),
}


@pytest.mark.parametrize("command", ENDLESS)
def test_what_would_never_end_is_not_begun(command, make_study, refused):
    words, says = ENDLESS[command]
    assert says in refused(command, make_study(), *words)


SPARSE = {
    "study.toml": ("study", "."),
    "target.csv": ("study", "."),
    "big.csv": ("score", "--proxy", "big.csv", "--target", "target.csv", "--metric", "distance:max"),
    "table.csv": ("import", "table.csv"),
    "log/samples.csv": ("diagnose", "log"),
    "model.toml": ("predict", "model.toml", "log", "--output", "poses.csv"),
    "mine.urdf": ("export", "good.toml", "--into", "mine.urdf", "--output", "patched.urdf"),
    "commands.csv": ("record", "../tiny", "--model", "good.toml", "--commands", "commands.csv", "--output", "out"),
}


@pytest.mark.parametrize("name", SPARSE)
def test_a_file_of_gigabytes_that_takes_no_place_on_disk_is_not_read(make_study, tmp_path, monkeypatch, refused, name):
    folder = make_study()
    write_tiny(tmp_path / "tiny")
    (folder / "good.toml").write_text(TWIN)
    (folder / "log").mkdir()
    foreign_robot.write_own_times(folder / "log", [foreign_robot.drive(1, seconds=12.0)])
    monkeypatch.chdir(folder)
    with open(name, "ab") as sparse:
        sparse.truncate(3 << 30)
    assert "it has 3221 MB, of " in refused(*SPARSE[name])


def test_who_means_a_large_file_may_allow_it(make_study, monkeypatch, refused):
    monkeypatch.setattr("proxytune.settings.SETTINGS_MB", 1e-5)
    folder = make_study()
    assert "PROXYTUNE_LARGEST_MB=1" in refused("repair", folder)
    monkeypatch.setenv("PROXYTUNE_LARGEST_MB", "1")
    assert "study.db: no such file; there is nothing to repair" in refused("repair", folder)
