"""The studies that travel with the package are what their READMEs say."""

import ast
import dataclasses
import functools
import importlib
import re
import runpy
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from proxytune.cli.main import main
from proxytune.domain import make_episode
from proxytune.learning import Distribution, collect_samples
from proxytune.learning.cloning import BehaviourCloning
from proxytune.study import load_family, read_study_settings

STUDIES = Path(__file__).resolve().parent.parent / "studies"
TRUTHS = STUDIES.parent / "benchmarks" / "truths"
MADE_FROM = {
    "quickstart": "truth.toml",
    "known_answer": "truth.toml",
    "duckiebot": "twin.toml",
    "closing_the_loop": "twin.toml",
    "closing_the_loop/two_effects": "twin.toml",
    "closing_the_loop/no_name": "twin.toml",
    "closing_the_camera_loop": "twin.toml",
    "teacher": "twin.toml",
    "../benchmarks/truths": "truth.toml",
    "which_simulator": "truth.toml",
    "gymnasium_pendulum": "truth.toml",
}
NEEDS = {"gymnasium_pendulum": "gymnasium"}
"""Studies whose target is made by a library that is an extra."""


@pytest.fixture
def study(tmp_path):
    """Copy a study, from so many starts; two are one in either lane."""

    def copy(name, starts=2):
        kept = shutil.ignore_patterns("study.db*", "figures", "*.lock")
        folder = Path(shutil.copytree(STUDIES / name, tmp_path / Path(name).name, ignore=kept))
        text = (folder / "study.toml").read_text(encoding="utf-8")
        (folder / "study.toml").write_text(re.sub(r"(?<=\nstarts = )\d+", str(starts), text), encoding="utf-8")
        return folder

    return copy


@pytest.mark.slow
@pytest.mark.parametrize("name", MADE_FROM)
def test_the_target_is_reproduced_but_for_last_digits_in_which_processors_differ(study, name, capsys):
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    folder = study(name)
    model, made = folder / MADE_FROM[name], folder / "again.csv"
    assert main(["measure", str(folder), "--model", str(model), "--output", str(made)]) == 0
    again, target = pd.read_csv(made), pd.read_csv(folder / "target.csv")
    pd.testing.assert_frame_equal(again, target[target["episode"] < 2].reset_index(drop=True), rtol=1e-6)


@pytest.mark.slow
def test_on_the_nominal_proxy_agents_spread_from_seconds_to_the_end_with_few_ties(study, capsys):
    folder = study("duckiebot", starts=3)
    nominal, made = folder / "nominal.toml", folder / "nominal.csv"
    nominal.write_text('format = 1\nrobot = "duckiebot"\n', encoding="utf-8")
    assert main(["measure", str(folder), "--model", str(nominal), "--output", str(made)]) == 0
    means = pd.read_csv(made).groupby("agent")[["distance", "survival_time"]].mean()
    assert len(means) >= 10
    assert means["survival_time"].min() < 6.0
    assert means["survival_time"].max() == 60.0
    assert means["distance"].min() < 1.0
    assert means["distance"].max() > 10.0
    assert (np.diff(np.sort(means["distance"])) > 0.05).sum() >= len(means) - 2, "agents tie on distance"


SCRIPTS = sorted([*STUDIES.rglob("*.py"), *(STUDIES.parent / "benchmarks").glob("*.py")])


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_what_a_script_takes_of_the_package_is_there(script):
    for node in ast.walk(ast.parse(script.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and f"{node.module}.".startswith("proxytune."):
            module = importlib.import_module(node.module)
            for alias in node.names:
                if not hasattr(module, alias.name):
                    importlib.import_module(f"{node.module}.{alias.name}")


@pytest.mark.slow
def test_the_published_tables_are_read_again_as_the_reference_has_them(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["page.py", str(tmp_path / "page.html"), str(tmp_path / "table.md")])
    runpy.run_path(str(STUDIES / "published" / "page.py"), run_name="__main__")
    assert (tmp_path / "table.md").read_text() in (STUDIES.parent / "docs" / "reference" / "published.md").read_text()
    assert "<svg" in (tmp_path / "page.html").read_text()


@pytest.mark.parametrize("name", MADE_FROM)
def test_targets_hold_every_agent_and_start_of_their_study(name):
    table = pd.read_csv(STUDIES / name / "target.csv")
    assert not table.isna().any().any()
    assert (table.groupby("agent").size() == table["episode"].nunique()).all()


@pytest.mark.parametrize("path", sorted(TRUTHS.glob("lacks_*.toml")), ids=lambda path: path.stem)
def test_what_truths_lack_is_an_effect_of_its_own_beyond_the_box(path):
    settings = read_study_settings(TRUTHS)
    held = dict(load_family(settings, path).effects)
    assert path.stem.removeprefix("lacks_") in " ".join(held)
    assert not set(held) & set(settings.space.names), "a truth would be written over it"
    assert held != dict(load_family(settings, None).effects)


@pytest.mark.slow
def test_an_imitator_of_enough_target_samples_drives_the_twins_loop(study):
    """Better than 45 of 60, on starts of the outer lane: the inner lane takes more lessons."""
    settings = read_study_settings(study("teacher"))
    twin = dataclasses.replace(load_family(settings, settings.teaching.target), plant="planar", seconds=30.0)
    learner = BehaviourCloning()
    weights = learner.train(collect_samples(twin, Distribution({}), count=1600, seed=3, lesson_s=5.0), None, 1)
    policy = functools.partial(learner.act, weights)
    scores = [twin.examine(make_episode({}, agent="pupil", start=start, seed=9), policy) for start in (1, 3, 6, 7)]
    assert np.mean(scores) > 30.0 * 45.0 / 60.0
    assert min(scores) >= -30.0
    assert max(scores) <= 30.0


@pytest.mark.parametrize("name", ["twin.toml", "target.csv"])
def test_the_study_of_randomisation_asks_of_the_same_target_as_that_of_teachers(name):
    assert (STUDIES / "which_randomisation" / name).read_bytes() == (STUDIES / "teacher" / name).read_bytes()
