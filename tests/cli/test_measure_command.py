import json

import pytest

from proxytune.cli.main import main
from proxytune.scores import read_scores


@pytest.fixture
def measured(make_study, tmp_path):
    folder = make_study()
    (tmp_path / "model.toml").write_text("trim = 0.1\ndelay = 0.12\n")

    def run(name, *options):
        output = tmp_path / name
        arguments = ["--model", str(tmp_path / "model.toml"), "--output", str(output), *options]
        return main(["measure", str(folder), *arguments]), output

    return run


def test_a_target_is_made_byte_for_byte_the_same_and_a_study_can_use_it(measured, make_study, capsys, answered):
    (status, one), (_, two) = measured("one.csv"), measured("two.csv", "--seed", "1001")
    assert status == 0
    assert one.read_bytes() == two.read_bytes()
    assert read_scores(one, ["distance", "survival_time"]).complete
    folder = make_study()
    (folder / "target.csv").write_bytes(one.read_bytes())
    capsys.readouterr()
    at = "trim=0.1,delay=0.12"
    (curve,) = answered("sweep", folder, "--parameter", "trim", "--points", "2", "--at", at)["curves"]
    assert {point["value"]: point["prpv"] for point in curve["points"]}[0.1] == 0


def test_another_seed_gives_other_scores(measured):
    assert measured("one.csv")[1].read_bytes() != measured("two.csv", "--seed", "7")[1].read_bytes()


def test_repeats_are_labelled_and_one_gives_the_table_of_none_asked_for(measured, capsys):
    plain, one = measured("plain.csv")[1], measured("one.csv", "--repeats", "1")[1]
    assert one.read_bytes() == plain.read_bytes()
    capsys.readouterr()
    status, two = measured("two.csv", "--repeats", "2", "--json")
    document = json.loads(capsys.readouterr().out)
    assert (status, document["repeats"], document["episodes"]) == (0, 2, 6)
    found = read_scores(two, ["distance"])
    assert found.episodes == ("0/0", "0/1", "1/0", "1/1", "2/0", "2/1")
    assert (found.values[:, ::2] == read_scores(plain, ["distance"]).values).all()
    assert all(len(set(agent[:, 0].tolist())) == 6 for agent in found.values), "each has noise of its own"


def test_the_document_names_the_seed_and_the_means(measured, capsys):
    measured("one.csv", "--json")
    document = json.loads(capsys.readouterr().out)
    assert document["seed"] == 1001
    assert document["episodes"] == 3
    assert set(document["means"]["agent0"]) == {"distance", "survival_time"}


def test_where_the_table_cannot_be_written_nothing_is_simulated(measured, capsys):
    status, output = measured("nowhere/one.csv")
    assert status == 2
    assert "its folder does not exist" in capsys.readouterr().err
    assert not output.exists()


def test_a_negative_seed_is_refused(measured, capsys):
    assert measured("one.csv", "--seed", "-1")[0] == 2
    assert "--seed must be at least 0" in capsys.readouterr().err


def test_a_missing_model_is_refused(make_study, tmp_path, capsys):
    output = tmp_path / "one.csv"
    status = main(["measure", str(make_study()), "--model", str(tmp_path / "no.toml"), "--output", str(output)])
    told = capsys.readouterr().err
    assert status == 2
    assert told == f"proxytune measure: --model {tmp_path / 'no.toml'}: no such file; check the path\n"
    assert not output.exists()
