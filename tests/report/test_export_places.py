"""Every effect has its place in every format or is said to have none, and what is said is true."""

import re
from pathlib import Path

import pytest
from export_truth import ROBOT, instance

from proxytune.cli.export import WRITERS
from proxytune.effects import CATALOGUE, theta_names
from proxytune.report.export.instance import lines_of
from proxytune.report.export.places import FORMATS, PLACES, place_of

PAGE = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "exporting.md"
NEEDED = {
    "floor_slope.push": {"floor_slope.x": 0.1},
    **{f"{effect}.imbalance": {} for effect in ("dead_band", "stiction", "saturation", "motor_lag", "backlash")},
    "saturation.imbalance": {"saturation.limit": 0.7},
}


def without_comments(text):
    return re.sub(r"<!--.*?-->|#.*", "", text, flags=re.DOTALL if "<!--" in text else 0)


def parameters():
    for effect in CATALOGUE.values():
        yield from ((effect.name, name, one) for name, one in zip(theta_names(effect), effect.parameters, strict=True))


def test_every_effect_of_the_catalogue_is_there():
    assert list(PLACES) == list(CATALOGUE)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize(("effect", "name", "parameter"), list(parameters()), ids=lambda value: str(value)[:30])
def test_a_value_changes_the_file_where_it_has_a_place_and_nowhere_else(form, effect, name, parameter):
    beside = NEEDED.get(name, {})
    values = [parameter.low + share * (parameter.high - parameter.low) for share in (0.4, 0.7)]
    texts = [
        without_comments(
            WRITERS[form](instance(**{key.replace(".", "__"): one for key, one in {**beside, name: value}.items()}))
        )
        for value in values
    ]
    assert (texts[0] != texts[1]) == bool(place_of(effect, form))


@pytest.mark.parametrize("form", FORMATS)
def test_what_has_no_place_stands_at_the_head_of_the_file_with_value_and_interval(form):
    found = instance(intervals={"dead_band.width": (0.05, 0.07)}, dead_band__width=0.06)
    head = WRITERS[form](found)
    assert "dead_band.width 0.06 duty (0.05 to 0.07): NO PLACE, not in this file" in head
    assert "delay 0.15 s" in head
    assert "dead_band.width" in [line.name for line in lines_of(found, form) if not line.place]


def test_neutral_values_that_have_no_place_are_not_told():
    names = [line.name for line in lines_of(instance(dead_band__width=0.0, turn_slip=0.0), "urdf")]
    assert not {"dead_band.width", "turn_slip"} & set(names)


def test_what_was_learnt_and_a_users_own_have_no_place():
    assert [place_of(name, form) for name in ("learnt", "weak_reverse:WeakReverse") for form in FORMATS] == [""] * 6


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_effect_is_in_the_table_of_the_page(name):
    row = f"| `{name}` | " + " | ".join(place or "no place" for place in PLACES[name]) + " |"
    assert row in PAGE.read_text(encoding="utf-8").splitlines()


def test_the_duckiebot_as_it_is_keeps_its_wheels_and_camera():
    from proxytune.driving import parse_urdf, read_body

    before = read_body(parse_urdf(ROBOT.urdf), ROBOT.urdf)
    assert WRITERS["urdf"](instance()).count(f'radius="{before.left.radius_m:g}"') == 4
