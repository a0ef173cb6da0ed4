"""Every effect and parameter is told in a plain clause, and a finding in a sentence with its size and worth."""

import re

import pytest
from readable import on_terminal

from proxytune.cli.main import main
from proxytune.diagnosis import Estimate
from proxytune.effects import CATALOGUE, DRIVES, Catalogue
from proxytune.report import Table, columns_of, table_text
from proxytune.report.meanings import CLAUSES, finding, findings, fitted, what_it_does

BAND = {
    "name": "dead_band",
    "parameters": {
        "width": {"value": 0.14996, "interval": [0.149, 0.151], "unit": "duty"},
        "imbalance": {"value": 0.0, "interval": [0.0, 0.0], "unit": ""},
    },
    "worth": {
        "1": {"value": 900.0, "interval": [850.0, 950.0], "unit": "%"},
        "2": {"value": 1900.0, "interval": [1700.0, 2200.0], "unit": "%"},
    },
}
SLIP = {
    "name": "turn_slip",
    "parameters": {"loss": {"value": 0.31, "interval": [0.27, 0.35], "unit": "s/rad"}},
    "worth": {"2": {"value": 13.2, "interval": [8.0, 19.0], "unit": "%"}},
}


def test_every_parameter_of_the_catalogue_has_a_clause_with_a_place_for_its_value():
    assert set(CLAUSES) == {name for drive in DRIVES for name in Catalogue(drive=drive).parameters}
    assert all(clause.count("{}") == 1 for clause in CLAUSES.values())


@pytest.mark.parametrize(("drive", "name"), [(drive, name) for drive, effects in DRIVES.items() for name in effects])
def test_every_effect_says_in_a_clause_what_it_does(drive, name):
    said = what_it_does(name, Catalogue(drive=drive))
    assert len(said.split()) >= 4
    assert "`" not in said


def test_what_was_found_or_declared_is_told_with_name_meaning_size_and_worth_and_of_many_a_few():
    assert finding(BAND) == (
        "dead band: wheels stand still below a duty of 0.150 (0.149 to 0.151); "
        "without it predictions over 2 s are 20 times as far off (18 to 23)"
    )
    assert finding(SLIP) == (
        "turn slip: turning costs forward speed, a share of 0.31 s/rad (0.27 to 0.35) for each rad/s; "
        "without it predictions over 2 s are 13 % worse (8 to 19)"
    )
    resists = {"square": {"value": -0.01, "interval": [-0.02, 0.01], "unit": "s²/m²"}}
    assert finding({"name": "inertia", "parameters": resists}).endswith(
        "by the factor 1 − 0.01 s²/m² (−0.01 to 0.02) times the square of the speed"
    )
    limit = {"value": 0.98, "interval": [0.97, 0.99], "unit": "duty"}
    share = {"value": 1.0, "interval": [0.9, 1.0], "unit": ""}
    assert finding({"name": "saturation", "parameters": {"limit": limit, "imbalance": share}}) == (
        "saturation: wheels turn no faster than at a duty of 0.98 (0.97 to 0.99) on average, 1 on the left wheel and "
        "0.96 on the right"
    )
    lag = {"value": 0.2, "interval": [0.19, 0.21], "unit": "s"}
    assert finding(
        {"name": "motor_lag", "parameters": {"time_constant": lag, "imbalance": {**share, "value": 0.1}}}
    ) == (
        "motor lag: wheels follow their commands with a lag of 0.20 s (0.19 to 0.21) on average, 0.18 on the left "
        "wheel and 0.22 on the right"
    )
    assert findings([BAND, SLIP]) == f"{finding(BAND)}; {finding(SLIP)}"

    assert "without it" not in finding({**SLIP, "worth": {"2": {"value": 0.0, "interval": [-2.0, 2.0], "unit": "%"}}})
    assert findings([{"name": "dead_band"}, {"name": "trim"}]) == "dead band and trim"

    own = {"name": "gone:Wheel", "parameters": {"shrink": {"value": 0.25, "interval": [0.25, 0.25], "unit": "m"}}}
    own["parameters"]["grow"] = {"value": 0.0, "interval": [0.0, 0.0], "unit": "1/s"}
    assert finding(own) == "gone:Wheel: shrink 0.25 m"
    several = {**own, "name": "my_lab:Wheel", "parameters": {"first_turn": own["parameters"]["shrink"]}}
    assert finding(several) == "my_lab:Wheel: first turn 0.25 m"
    # A declared trim that was found stands in the first sentence; what is in no θ and equal wheels are not told.
    trim, delay = Estimate(0.0433, (0.0421, 0.0446), ""), Estimate(0.12, (0.1, 0.14), "s")
    assert fitted(("trim", "delay"), {"delay": delay, "trim": trim}) == (
        ", with trim 0.043 (0.042 to 0.045) and delay 0.12 s (0.10 to 0.14)"
    )
    wide = Estimate(0.0249, (-0.0259, 0.0757), "")
    assert fitted(("trim",), {"trim": wide}) == ", with trim 0.02 (−0.03 to 0.08)"
    assert fitted(("trim", "motor_lag.imbalance"), {"motor_lag.imbalance": trim}) == ""
    assert fitted(("my_lab:Wheel.first_turn",), {"my_lab:Wheel.first_turn": delay}) == (
        ", with my_lab:Wheel.first_turn 0.12 s (0.10 to 0.14)"
    )
    many = fitted((f"wheel_gain.{side}" for side in "abcdef"), {f"wheel_gain.{side}": trim for side in "abcdef"})
    assert many.startswith(", with wheel gain a 0.043")
    assert many.endswith(" and 2 more")


def test_effects_are_a_row_each_within_80_columns_unbroken_and_an_unknown_one_is_asked_back(
    monkeypatch, capsys, refused
):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["list", "effects"]) == 0
    told = capsys.readouterr().out
    assert max(map(len, told.splitlines())) <= 80
    words = set(re.findall(r"\S+", told.replace("*", " ").replace(",", " ")))
    assert set(CATALOGUE) <= words
    assert {one.name for effect in CATALOGUE.values() for one in effect.parameters} <= words
    assert "no 'ded_band'; did you mean 'dead_band'?" in refused("list", "effects", "ded_band")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("effects", "dead_band"), "wheels stand still below a duty of WIDTH"),
        (("effects", "slippery_patch"), "slippery_patch.radius, 0.1 to 5 m, 0.5 m where it is not given meaning"),
        (("effects", "steering_curve"), "without effect at the robot's wheel angle"),
        (("effects", "dead_band"), "of a car: dead_band: The motor does nothing"),
        (("effects", "yaw_scrub"), "without effect at the robot's effective baseline"),
        (("robots", "husky"), "mass kg: 56.6"),
    ],
)
def test_all_of_one_is_told(words, said, capsys):
    assert main(["list", *words]) == 0
    assert said in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("width", [30, 60, 80, 200])
def test_no_word_of_a_table_is_broken_however_narrow_the_terminal(width):
    topic = "/front/camera/image_raw/compressed"
    rows = ((topic, "sensor_msgs/msg/CompressedImage", "812", "frames, every second one of them"),) * 2
    told = on_terminal(table_text(Table("", columns_of(("what", "type", "count", "for")), rows)), width=width)
    assert {topic, "sensor_msgs/msg/CompressedImage", "every"} <= set(told.split())
    assert max(map(len, told.splitlines())) <= max(width, len(topic) + 31 + 5 + 7 + 6)
