"""How often the diagnosis is right, over hidden effects of every kind."""

import numpy as np
import pytest
import rates
from hidden_cases import Case
from joblib import Parallel, delayed
from rates import Job, all_jobs

EVERY = {"first": 90, "second": 40}
"""Every so many-th case of each kind, by generator; at least one.

All of them are counted at full size, twelve one-minute drives, by `python benchmarks/rates.py`.
"""


@pytest.mark.slow
def test_what_is_hidden_is_named_and_what_cannot_be_named_is_flagged(capsys):
    jobs = [job for generator, every in EVERY.items() for job in all_jobs(every, generator)]
    rows = Parallel(n_jobs=2)(delayed(rates.diagnosed)(job, episodes=6, seconds=30.0) for job in jobs)
    counted = rates.rates(rows)
    with capsys.disabled():
        print()
        print("\n".join(row.text for row in rows))
        print("\n".join(f"{name}: {rate}" for name, rate in counted.items()))
        print(rates.confusion(rows))
    assert counted["failed"].hits == 0
    assert counted["in form and material: named"].share >= 0.85
    assert counted["in form and material: named, nothing beside"].share >= 0.75
    assert counted["in form wrong without a flag"].share <= 0.15
    assert counted["pairs both named"].share >= 0.5
    assert counted["clean false alarms"].share <= 0.4
    assert counted["taken out flagged"].share >= 0.5
    assert counted["explained beyond 1.3 x the true floor"].share <= 0.1
    assert counted["floor bracket holds the true one"].share >= 0.75
    assert counted["outside flagged"].share >= 0.8
    others = [row for row in rows if row.job.kind == "other form"]
    assert all(row.after <= 1.3 * row.true for row in others) or counted["other form right or flagged"].share >= 0.5


def row(kind, verdict, *adopted, right=(), **more):
    case = Case("case", (), "normal", 1, 0.0, 0.0, right)
    without = "dead_band" if kind == "taken out" else ""
    return rates.Row(Job(kind, case, without), verdict, adopted, **more)


def test_a_hidden_effect_counts_as_named_if_it_or_its_rival_was_added_and_else_is_wrong():
    hidden = (("dead_band",), ("motor_lag", "delay"))
    assert row("pair", "explained", ("dead_band",), ("stiction", "motor_lag"), right=hidden).right
    assert not row("pair", "explained", ("dead_band",), right=hidden).right
    assert row("clean", "nothing missing").right

    hidden = (("dead_band",),)
    assert row("in form", "explained", ("dead_band",), ("turn_slip",), right=hidden).wrong
    assert not row("in form", "explained", ("stiction", "dead_band"), right=hidden).wrong
    assert not row("in form", "partly explained", ("turn_slip",), right=hidden).wrong
    assert row("taken out", "explained", ("dead_band",), right=hidden).wrong

    with rates._without("dead_band"):
        forms = rates.looking.candidates(rates.read_robot("duckiebot"), {}, ())
    assert "stiction" in {form.effect for form in forms}
    assert "dead_band" not in {form.effect for form in forms}
    assert rates.looking.candidates is rates.candidates


def test_rates_count_what_they_say():
    hidden = (("dead_band",),)
    rows = [
        row("in form", "explained", ("dead_band",), right=hidden, evidence=99.0, before=2.0, after=1.04, true=1.0),
        row("in form", "nothing missing", right=hidden, evidence=10.0, before=1.04, true=1.0),
        row("in form", "explained", ("dead_band",), ("trim",), right=hidden, before=2.0, learnt=1.2, true=1.0),
        row("clean", "explained", ("trim",)),
        row("clean", "nothing missing"),
        row("taken out", "unexplained", right=hidden),
        row("outside", "explained", ("dead_band",)),
    ]
    counted = {name: (rate.hits, rate.of) for name, rate in rates.rates(rows).items()}
    assert counted["in form and material: named"] == (2, 2)
    assert counted["in form and material: named, nothing beside"] == (1, 2)
    assert counted["in form, not material: nothing wrong named"] == (1, 1)
    assert counted["clean false alarms"] == (1, 2)
    assert counted["taken out flagged"] == (1, 1)
    assert counted["outside flagged"] == (0, 1)
    assert "worst 1.20 (case)" in rates.errors(rows)
    assert "nothing" in rates.confusion(rows)


def test_every_kind_has_a_share_of_any_beginning_but_the_bullet_plant_of_the_second_generator():
    kinds = {job.kind for job in all_jobs()[:60]}
    assert kinds == {"in form", "other form", "pair", "outside", "taken out", "clean", "bullet"}
    names = [(job.kind, job.case.name) for job in all_jobs()]
    assert len(names) == len(set(names)) > 200
    jobs = all_jobs(generator="second")
    assert {job.kind for job in jobs[:60]} == {"in form", "other form", "pair", "outside", "taken out", "clean"}
    assert {job.generator for job in jobs} == {"second"}
    assert len({rates.key(job) for job in (*jobs, *all_jobs())}) == len(jobs) + len(all_jobs())


@pytest.mark.parametrize("generator", ["first", "second"])
def test_a_row_comes_back_from_json_as_it_was(generator):
    for job in all_jobs(every=20, generator=generator):
        told = rates.Row(job, "explained", (("dead_band", "stiction"),), ("heading",), 12.5, floor=(0.001, np.nan))
        line = rates.to_json(told)
        back = rates.from_json(line)
        assert "\n" not in line
        assert "NaN" not in line
        assert repr(back) == repr(told)
        assert back.job.generator == generator


def test_a_file_of_rows_goes_on_after_a_line_that_was_cut_off(tmp_path):
    file, jobs = tmp_path / "rows.jsonl", all_jobs(generator="second")[:3]
    assert rates.read_rows(file) == []
    rates.append(file, rates.Row(jobs[0], "nothing missing"))
    file.write_text(file.read_text() + rates.to_json(rates.Row(jobs[1], "explained"))[:40])
    rates.append(file, rates.Row(jobs[2], "failed", problem="ValueError: none"))
    assert [row.job for row in rates.read_rows(file)] == [jobs[0], jobs[2]]


@pytest.mark.parametrize("generator", ["first", "second"])
def test_a_job_is_measured_by_its_own_generator_from_the_same_starts_with_noise_or_without(generator):
    job = all_jobs(every=30, generator=generator)[0]
    loud, quiet = (rates._log(job, 2, 4.0, noiseless) for noiseless in (False, True))
    assert loud.name == quiet.name == job.case.name
    for one, other in zip(loud.episodes, quiet.episodes, strict=True):
        np.testing.assert_array_equal(one.commands, other.commands)
        assert 0.0 < np.abs(one.poses - other.poses)[0].max() < 0.1
