"""The comparison of engines as figure, tables, JSON and page."""

from dataclasses import replace
from io import BytesIO

import compare_report
import compared_engines
import numpy as np
import pytest
from compare_report import compare_document, compare_figure, compare_lines, compare_tables, looks_of, verdict
from compared_engines import ENGINES, NAMES
from judgement import Judgement, Reading
from PIL import Image
from readable import on_terminal
from runs import Estimate, Run, RunKey, summarise

from proxytune.report import foot_of, table_text
from proxytune.report.html import page_html
from proxytune.search import Engine, Look
from proxytune.search.engine import Sobol


def runs(engine, *curves, reading=None):
    return [
        Run(
            RunKey("o", engine, seed, len(curve), 2, ""),
            ((0.0,),) * len(curve),
            0.5,
            Judgement(tuple(curve), (0.0,), curve[-1] + 5.0, curve[-1], 0.1, reading, ""),
        )
        for seed, curve in enumerate(curves)
    ]


GP = runs("gp", [9.0, 4.0, 0.0], [8.0, 3.0, 0.0])
SOBOL = runs("sobol", [9.0, 8.0, 8.0], [8.0, 8.0, 9.0])


def test_every_engine_has_its_median_and_its_name_at_the_end_of_its_line():
    (axes,) = compare_figure([GP, SOBOL], 1.0).axes
    drawn = {line.get_label(): line for line in axes.get_lines()}
    assert list(drawn["gp (2 seeds)"].get_ydata()) == [8.5, 3.5, 0.0, 0.0]
    assert list(drawn["sobol (2 seeds)"].get_ydata()) == [8.5, 8.0, 8.0, 8.0]
    assert list(drawn["noise floor"].get_ydata()) == [1.0, 1.0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("evaluations", "lowest regret so far [ordered pairs]")

    together = [runs(engine, [9.0, 5.0 + number % 3, 3.0]) for number, engine in enumerate(NAMES)]
    figure = compare_figure(together, 1.0)
    figure.draw_without_rendering()
    names = [text for text in figure.axes[0].texts if text.get_text() != compare_report.SHARED]
    boxes = [text.get_window_extent() for text in names]
    assert [text.get_text() for text in names] == [*NAMES, "noise floor"]
    assert not any(one.overlaps(other) for row, one in enumerate(boxes) for other in boxes[:row])
    assert max(box.x1 for box in boxes) <= figure.bbox.x1
    assert figure.get_figwidth() * 25.4 <= 86.0


def test_engines_keep_colours_of_their_own_whether_known_or_not():
    colours = {"outcomes": "#D55E00", "gp": "#0072B2", "composite": "#E69F00", "random": "0.55", "sobol": "0.55"}
    colours |= {"tpe": "#009E73", "skopt": "#CC79A7", "gpsampler": "#56B4E9", "qlognei": "0.15"}
    colours |= {"botorch_composite": "0.15", "emulator": "#882255"}
    assert {name: look.colour for name, look in looks_of(NAMES).items()} == colours
    strangers = [f"stranger{number}" for number in range(9)]
    looks = looks_of([*NAMES, *strangers])
    assert len(set(looks.values())) == len(NAMES) + len(strangers)
    assert not {looks[name] for name in strangers} & {engine.look for engine in ENGINES}


@pytest.mark.parametrize("wish", [Look("blurple"), Look("#D55E00", "wavy")])
def test_a_look_that_cannot_be_drawn_is_one_of_the_palette(wish, monkeypatch):
    monkeypatch.setattr(compared_engines, "PEERS", (Engine("odd", "odd", "proposes oddly", Sobol, look=wish),))
    assert looks_of(["odd"])["odd"] in compare_report.PALETTE


def test_the_tables_tell_how_good_how_soon_and_what_is_known():
    reading = Reading(0.02, True, {"delay": True, "trim": False}, 0.4, True)
    engines = [runs("outcomes", [9.0, 4.0], [8.0, 0.0], reading=reading), runs("gp", [9.0, 8.0], [8.0, 7.0])]
    tables = compare_tables("truths", [summarise(group, engines[0], 1.0, 960.0) for group in engines], 2)
    told = on_terminal(*map(table_text, tables))
    for expected in (
        "7.0 (5.0 to 9.0)",
        "5.5 (4.0 to 7.0)",
        "2 of 2",
        "2.0% (2.0% to 2.0%)",
        "delay 2",
        "trim 0",
        "0 of 2",
        "1.40 (1.00 to 1.80)",  # of the truth's
        "0.00 (0.00 to 0.00)",  # θ error less
        "2400 (1920 to 2880)",  # simulated s
        "2880 (2880 to 2880)",
    ):
        assert expected in told


def test_a_verdict_needs_an_interval_clear_of_zero_and_the_document_gives_every_engine_one():
    found = summarise(SOBOL, GP, 1.0)
    cases = ((0.5, 3.0, "needs significantly fewer"), (-3.0, -0.5, "significantly more"), (-0.5, 3.0, "no signific"))
    for low, high, expected in cases:
        assert expected in verdict(replace(found, saved=Estimate(1.0, low, high)))
    summaries = [summarise(group, GP, 1.0) for group in (GP, SOBOL)]
    document = compare_document("analytic", summaries, 3, 1.0)
    assert document["default"] == "gp"
    assert [row["verdict"] for row in document["engines"]] == [
        "is the engine that the others are compared with",
        "needs significantly fewer evaluations",
    ]
    assert document["engines"][1]["saved"] == {"value": 1.0, "low": 1.0, "high": 1.0}
    assert compare_lines(summaries)[0] == (
        "gp needs significantly fewer evaluations than sobol to reach the noise floor (paired 95 % interval)"
    )


def page_of(*grouped, tolerance=1.0):
    image = BytesIO()
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(image, format="png")
    summaries = [summarise(one, grouped[0], tolerance) for one in grouped]
    return compare_report.compare_view("<script>", summaries, 3, image.getvalue())


def test_the_page_tells_each_engine_s_answer_and_takes_no_name_for_markup():
    page = page_of(GP, SOBOL)
    assert page.sentence.startswith("gp needs significantly fewer evaluations than sobol")
    assert page.next_step == "keep gp."
    assert 'set engine = "gp" in study.toml' in page_of(SOBOL, GP).next_step
    page = page_of(SOBOL, runs("gp", [9.0, 9.0, 9.0], [8.0, 8.0, 8.0]))
    assert page.sentence.startswith("No engine reached the noise floor in 3 evaluations")
    assert "significantly" not in page.sentence
    assert "raise --budget" in page.next_step
    text = page_html(page_of(GP, SOBOL), foot_of("compare"))
    assert "<script" not in text
    assert text.count("<table>") == 2
