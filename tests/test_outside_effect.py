"""A user's effect beside a study, or in a plug-in, is simulated, written and read as a shipped one is.

test_extending.py has one found by `diagnose`.
"""

import re

import pytest
from one_line import complaint_of
from outside_effects import NAME, WEAK_REVERSE, WRONG
from planted import ROBOT

from proxytune.diagnosis.motion.screening import motion_effects
from proxytune.driving import lane_following
from proxytune.effects import Catalogue, Model, effect_of, effects_from, model_text, read_model
from proxytune.extensions.door import GROUP
from proxytune.settings import Section

TABLE = f'format = 1\nrobot = "duckiebot"\n\n[effects."{NAME}"]\nloss = 0.3\n'
TWO = WEAK_REVERSE.replace("    loss: float\n", "    loss: float\n    bias: float\n").replace(
    "        ),\n    )\n",
    '        ),\n        Parameter(name="bias", unit="m/s", low=0.0, high=0.1, neutral=0.0, probes=(0.05,)),\n    )\n',
)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "weak_reverse.py").write_text(WEAK_REVERSE, encoding="utf-8")
    return tmp_path


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A site with a plug-in effect of the name `slow_back`."""
    info = tmp_path / "site" / "slow_back_pack-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: slow_back_pack\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\neffect.slow_back = slow_back_pack:WeakReverse\n")
    (tmp_path / "site" / "slow_back_pack.py").write_text(WEAK_REVERSE, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))


def test_the_effect_of_a_parameter_is_told_from_its_name():
    assert effect_of("dead_band.width") == "dead_band"
    assert effect_of("lab.motion.drift:Drift") == "lab.motion.drift:Drift"
    assert effect_of("lab.motion.drift:Drift.rate") == "lab.motion.drift:Drift"


def test_one_parameter_has_the_effect_s_name_and_several_add_theirs(folder):
    (folder / "two.py").write_text(TWO, encoding="utf-8")
    catalogue = Catalogue(folder)
    assert catalogue.theta_names(NAME) == (NAME,)
    assert catalogue.theta_names("two:WeakReverse") == ("two:WeakReverse.loss", "two:WeakReverse.bias")
    assert catalogue.parameters["two:WeakReverse.bias"].unit == "m/s"
    assert "two:WeakReverse.lost" not in catalogue.parameters
    assert "two:WeakReverse" not in catalogue.parameters


def test_it_comes_after_the_shipped_effects_of_its_stage(folder):
    theta = {NAME: 0.3, "turn_slip": 0.01, "trim": 0.1}
    made = effects_from(theta, ROBOT.figures, Catalogue(folder))
    assert [effect.name for effect in made] == ["trim", "turn_slip", "weak_reverse"]
    told = complaint_of(effects_from, {NAME: 1.0}, ROBOT.figures, Catalogue(folder))
    assert "must be between 0 and 0.9" in told


def test_two_folders_have_effects_of_one_name_each_its_own(folder, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    (other / "weak_reverse.py").write_text(WEAK_REVERSE.replace("high=0.9", "high=0.85"), encoding="utf-8")
    assert Catalogue(folder).parameters[NAME].high == 0.9
    assert Catalogue(other).parameters[NAME].high == 0.85


def test_model_toml_names_it_in_quotes_and_reads_back_the_same(folder):
    model = Model("duckiebot", None, {NAME: 0.25, "trim": 0.1}, {NAME: (0.2, 0.3)})
    catalogue = Catalogue(folder)
    path = folder / "model.toml"
    path.write_text(model_text(model, catalogue=catalogue), encoding="utf-8")
    assert f'[effects."{NAME}"]' in path.read_text(encoding="utf-8")
    assert read_model(path, catalogue) == model
    path.write_text(TABLE.replace("weak_reverse:", "weak_revers:"), encoding="utf-8")
    told = complaint_of(read_model, path, catalogue)
    assert re.search("model.toml: effects.weak_revers:WeakReverse: effect .* no module 'weak_revers'", told)


@pytest.mark.parametrize("case", WRONG)
def test_an_effect_that_is_not_what_it_claims_is_refused_by_name(tmp_path, case):
    old, new, expected = WRONG[case]
    text = WEAK_REVERSE.replace(old, new)
    assert text != WEAK_REVERSE
    (tmp_path / "weak_reverse.py").write_text(text, encoding="utf-8")
    assert re.search(f"effect '{NAME}'.*{expected}", complaint_of(Catalogue(tmp_path).effect, NAME))


def test_a_domain_takes_it_from_its_table_from_theta_and_from_a_model(folder):
    (folder / "model.toml").write_text(TABLE, encoding="utf-8")
    section = Section(folder / "study.toml", "domain.", {"plant": "planar", "seconds": 2.0})
    plain, given = (lane_following(section, model=model) for model in (None, folder / "model.toml"))
    held = Section(section.path, "domain.", {**section.values, "effects": {NAME: {"loss": 0.3}}})
    assert given == lane_following(held, model=None) != plain
    assert plain.parameters[NAME].high == 0.9
    assert plain.instance({NAME: 0.3}).drivetrain == given.instance({}).drivetrain


def test_a_plugin_s_effect_takes_part_by_itself(installed, folder):
    catalogue, model = Catalogue(folder), Model("duckiebot", None, {"slow_back": 0.3}, {})
    assert "slow_back" in motion_effects(catalogue)
    assert "[effects.slow_back]" in model_text(model, catalogue=catalogue)


def test_list_shows_a_plugin_s_effect(installed, answered):
    rows = answered("list", "effects")["effects"]
    (row,) = [row for row in rows if row["effect"] == "slow_back"]
    assert (row["parameter"], row["stage"], row["high"]) == ("slow_back", "motion", 0.9)


def test_an_unknown_effect_is_told_with_the_way_to_name_one_s_own(folder):
    (folder / "model.toml").write_text(TABLE.replace(f'"{NAME}"', "weak_revers"), encoding="utf-8")
    told = complaint_of(read_model, folder / "model.toml", Catalogue(folder))
    assert re.search("weak_revers: no such effect; .*your own is written module:Attribute", told)
