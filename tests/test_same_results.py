"""The script that compares two checkouts tells the last bit, and leaves out nothing but what it states."""

from pathlib import Path

import pytest
import same_results
from results_to_compare import PARTS, Part

STUDY = 'format = 1\nagents = [\n    "a",\n]\nbudget = 9\n\n[domain]\nseconds = 20.0\n\n[teaching]\nbudget = 7\n'


@pytest.mark.parametrize(
    ("before", "after", "where"),
    [
        ({"prpv": [1.0, 0.1 + 0.2]}, {"prpv": [1.0, 0.3]}, "/prpv/1"),
        ({"count": 1}, {"count": 1.0}, "/count"),
        ({"value": 0.0}, {"value": -0.0}, "/value"),
        ({"rows": ["a", "b"]}, {"rows": ["a", "b", "c"]}, "/rows/2 (of 2 and 3)"),
        ({"best": {"trim": 1.0}}, {"best": {}}, "/best/trim"),
        ({}, {"new": None}, "/new"),
    ],
)
def test_a_difference_is_told_by_its_path(before, after, where):
    assert [path for path, _, _ in same_results.differences(before, after)] == [where]


def test_what_differs_by_nature_is_left_out_and_masked_and_nothing_else():
    before = {"cut_off": {"seconds": 1.0, "trials": 2}, "value": float("nan")}
    assert not list(same_results.differences(before, {"cut_off": {"seconds": 9.0, "trials": 2}, "value": float("nan")}))
    assert list(same_results.differences(before, {"cut_off": {"seconds": 1.0, "trials": 3}, "value": float("nan")}))
    assert same_results.same("saved 2 episodes (0.149 s)", "saved 2 episodes (0.235 s)")
    assert not same_results.same("saved 2 episodes (0.149 s)", "saved 3 episodes (0.149 s)")
    assert not same_results.same("delay 0.107 s (0.092 s)", "delay 0.107 s (0.093 s)")


def test_keys_of_a_study_are_set_in_their_own_table_and_no_two_parts_share_what_is_kept():
    text = same_results.edited(STUDY, {"budget": 2, "starts": 1, "domain__seconds": 3.0, "nowhere__seconds": 1.0})
    changed = {"format = 1": "starts = 1\nformat = 1", "budget = 9": "budget = 2", "seconds = 20.0": "seconds = 3.0"}
    expected = STUDY
    for before, after in changed.items():
        expected = expected.replace(before, after)
    assert text == expected
    versions = [part.version for part in PARTS]
    assert len(set(versions)) == len(versions)


def test_a_command_that_ends_otherwise_than_it_should_is_a_failure_and_no_answer(tmp_path):
    place = same_results.Place(tmp_path, Path(same_results.__file__).parent.parent, None)
    with pytest.raises(same_results.CannotRunError, match="exit status 2"):
        place.run("no_such_command")


@pytest.mark.slow
def test_what_a_checkout_computes_is_collected_and_the_same_again(tmp_path, capsys):
    def ask(place):
        place.write("given.csv", "a,b\n")
        place.run("list measures --json")
        place.python("made", "open('made.csv', 'w').write('x\\n1.5\\n')")

    part, checkout = Part("measures", ask), Path(same_results.__file__).parent.parent
    answers = same_results.answers_of(part, checkout, None, None)
    assert answers["written"] == {"made.csv": ["x", "1.5"]}
    assert answers["printed"]["list measures --json"]["said"]["measures"]
    assert same_results.report(part, answers, answers)
    assert not same_results.report(part, answers, {**answers, "written": {"made.csv": ["x", "1.6"]}})
    assert "/written/made.csv/1" in capsys.readouterr().out
