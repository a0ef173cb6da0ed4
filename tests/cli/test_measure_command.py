import shutil

import pytest
from several import make_several

from proxytune.cli.main import main
from proxytune.files import shipped
from proxytune.scores import read_scores
from proxytune.study import open_study


@pytest.fixture
def words(make_study, tmp_path):
    """The words that measure a study's agents on a model, into a table of this name."""
    (tmp_path / "model.toml").write_text("trim = 0.1\ndelay = 0.12\n")
    base = ("measure", make_study(), "--model", tmp_path / "model.toml", "--output")
    return lambda name, *options: (*base, tmp_path / name, *options)


@pytest.fixture
def measured(words, answered, tmp_path):
    """The table that a command has written."""

    def run(name, *options):
        answered(*words(name, *options))
        return tmp_path / name

    return run


def test_a_target_is_the_same_byte_for_byte_named_by_its_seed_and_fit_for_a_study(
    measured, make_study, answered, words
):
    one, two = measured("one.csv"), measured("two.csv", "--seed", "1001")
    assert one.read_bytes() == two.read_bytes() != measured("other.csv", "--seed", "7").read_bytes()
    assert read_scores(one, ["distance", "survival_time"]).complete
    folder = make_study()
    (folder / "target.csv").write_bytes(one.read_bytes())
    at = "trim=0.1,delay=0.12"
    (curve,) = answered("sweep", folder, "--parameter", "trim", "--points", "2", "--at", at)["curves"]
    assert {point["value"]: point["prpv"] for point in curve["points"]}[0.1] == 0
    document = answered(*words("one.csv"))
    assert (document["seed"], document["episodes"]) == (1001, 3)
    assert set(document["means"]["agent0"]) == {"distance", "survival_time"}


def test_the_study_and_the_robot_of_the_model_are_kept_and_an_earlier_target_is_replaced(
    make_study, tmp_path, refused, answered
):
    shutil.copytree(shipped("robots") / "duckiebot", tmp_path / "duckiebot")
    folder, model = make_study(), tmp_path / "model.toml"
    model.write_text('trim = 0.1\nrobot = "duckiebot"\n')
    (folder / "study.db").touch()
    for kept in (folder / "study.db", folder / "study.toml", tmp_path / "duckiebot" / "robot.toml"):
        for study in (folder, folder / "study.toml"):
            told = refused("measure", study, "--model", model, "--output", kept)
            assert f"{kept.name}: is read by this command, and would be lost" in told
    model.write_text("trim = 0.1\n")
    answered("measure", folder, "--model", model, "--output", folder / "target.csv")


def test_the_files_of_the_study_around_a_family_are_kept(make_study, refused):
    folder = make_several(make_study)
    for kept in ("study.toml", "right.toml"):
        words = ("--model", folder / "wrong.toml", "--output", folder / kept)
        assert f"{kept}: is read by this command" in refused("measure", folder / "families" / "right", *words)


def test_repeats_are_labelled_and_one_gives_the_table_of_none_asked_for(measured, words, answered, tmp_path):
    plain, one = measured("plain.csv"), measured("one.csv", "--repeats", "1")
    assert one.read_bytes() == plain.read_bytes()
    document = answered(*words("two.csv", "--repeats", "2"))
    assert (document["repeats"], document["episodes"]) == (2, 6)
    found = read_scores(tmp_path / "two.csv", ["distance"])
    assert found.episodes == ("0/0", "0/1", "1/0", "1/1", "2/0", "2/1")
    assert (found.values[:, ::2] == read_scores(plain, ["distance"]).values).all()
    assert all(len(set(agent[:, 0].tolist())) == 6 for agent in found.values), "each has noise of its own"


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("one.csv", ("--seed", "-1"), "--seed must be at least 0"),
        ("one.csv", ("--model", "no.toml"), "proxytune measure: --model no.toml: no such file; check the path\n"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(words, refused, tmp_path, name, options, says):
    assert says in refused(*words(name, *options))
    assert not (tmp_path / name).exists()


def test_a_model_that_a_family_does_not_follow_is_a_caution(words, answered, make_study, tmp_path):
    assert answered(*words("one.csv"))["cautions"] == []
    folder = make_study(family='"deaf:make"')
    (folder / "deaf.py").write_text("from wobbly import Wobbly\n\n\ndef make(domain, *, model):\n    return Wobbly()\n")
    words = ("measure", folder, "--model", tmp_path / "model.toml", "--output", tmp_path / "two.csv")
    (line,) = answered(*words)["cautions"]
    assert "model.toml: deaf:make is the same without it (identity), so its factory reads no value in it" in line


def test_a_metric_that_episodes_lack_is_left_out_of_the_table_and_said(make_study, answered, tmp_path, capsys):
    folder = make_study(metrics='["survival_time:max"]', domain={"faults": '["agent0:*:nan", "agent1:2:nan"]'})
    (tmp_path / "model.toml").write_text("trim = 0.1\n")
    words = ("measure", folder, "--model", tmp_path / "model.toml", "--output", tmp_path / "one.csv")
    line = "distance: missing in 4 of 18 episodes, left out of the table"
    assert answered(*words)["cautions"] == [line]
    assert main([*map(str, words)]) == 0
    assert f"beware: {line}\n" in capsys.readouterr().out
    assert (tmp_path / "one.csv").read_text().startswith("agent,episode,survival_time\n")


def test_agents_that_a_study_holds_out_are_measured_too_and_no_news_to_it(make_study, answered, refused, tmp_path):
    changes = {"agents": '["agent0", "agent1", "agent2"]', "held_out": '["agent4", "agent5", "agent3"]'}
    folder, model = make_study(**changes), tmp_path / "model.toml"
    model.write_text("trim = 0.1\n")
    words = ("measure", folder, "--model", model, "--output", folder / "target.csv")
    assert answered(*words)["agents"] == ["agent0", "agent1", "agent2", "agent4", "agent5", "agent3"]
    study = open_study(folder)
    assert (study.settings.agents, study.cautions) == (("agent0", "agent1", "agent2"), ())
    make_study(**{**changes, "held_out": '["agent4", "nobody"]'})
    assert "study.toml: held_out: no agent 'nobody'" in refused(*words)
