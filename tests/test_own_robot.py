"""docs/how-to/own_robot.md works as it stands, line by line, in an empty folder."""

import json
import re
import shlex
from pathlib import Path

import pytest

from proxytune.cli.main import main
from proxytune.skeletons.writing import SIX

PAGE = (Path(__file__).resolve().parent.parent / "docs" / "how-to" / "own_robot.md").read_text(encoding="utf-8")
LINES = [
    line
    for block in re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL)
    for line in block.splitlines()
    if line.startswith("python -m proxytune ")
]
QUICK = {
    "budget = 16": "budget = 5",
    "initial = 8": "initial = 4",
    "starts = 4": "starts = 2",
    "seconds = 10.0": "seconds = 5.0",
}


def test_the_page_states_the_six_figures_that_a_skeleton_is_made_of():
    assert re.findall(r"(\w+)=", LINES[0]) == list(SIX)
    assert tuple(re.findall(r"^\| `(\w+)` \|", PAGE, flags=re.MULTILINE)) == SIX


@pytest.mark.slow
def test_every_line_of_the_page_runs_and_the_dead_band_is_found(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    answers = {}
    for line in LINES:
        words = shlex.split(line)[3:]
        assert main([*words, "--json"]) == 0, f"{line}: {capsys.readouterr().err}"
        answers[words[0]] = json.loads(capsys.readouterr().out)
        if words[:2] == ["new", "study"]:
            study = tmp_path / "rover_study" / "study.toml"
            text = study.read_text()
            for before, after in QUICK.items():
                assert before in text
                text = text.replace(before, after)
            study.write_text(text)
    found = answers["diagnose"]
    assert (found["verdict"], [effect["name"] for effect in found["effects"]]) == ("explained", ["dead_band"])
    assert found["effects"][0]["parameters"]["width"]["value"] == pytest.approx(0.06, abs=0.01)
    assert answers["predict"]["error"]["value"] < 0.02
    assert "dead_band.width" in [line["name"] for line in answers["export"]["no_place"]]
