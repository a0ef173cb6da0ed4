"""The page of `compare`."""

from io import BytesIO

import numpy as np
from PIL import Image

from proxytune.comparison.judgement import Judgement
from proxytune.comparison.runs import Run, RunKey
from proxytune.comparison.summary import summarise
from proxytune.report.compare.page import compare_view
from proxytune.report.html import page_html
from proxytune.report.view import foot_of


def runs(engine, *curves):
    return [
        Run(
            RunKey("o", engine, seed, len(curve), 2, ""),
            ((0.0,),) * len(curve),
            0.5,
            Judgement(tuple(curve), (0.0,), curve[-1] + 5.0, curve[-1], 0.1, None, ""),
        )
        for seed, curve in enumerate(curves)
    ]


GP = runs("gp", [9.0, 4.0, 0.0], [8.0, 3.0, 0.0])
SOBOL = runs("sobol", [9.0, 8.0, 8.0], [8.0, 8.0, 9.0])


def page_of(*grouped, tolerance=1.0):
    image = BytesIO()
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(image, format="png")
    summaries = [summarise(one, grouped[0], tolerance) for one in grouped]
    return compare_view("<script>", summaries, 3, image.getvalue())


def test_the_answer_is_what_the_terminal_says_of_each_engine():
    page = page_of(GP, SOBOL)
    assert page.sentence.startswith("gp needs significantly fewer evaluations than sobol")
    assert page.next_step == "keep gp."
    assert 'set engine = "gp" in study.toml' in page_of(SOBOL, GP).next_step


def test_where_no_engine_reached_the_floor_nothing_is_said_of_which_is_sooner():
    page = page_of(SOBOL, runs("gp", [9.0, 9.0, 9.0], [8.0, 8.0, 8.0]))
    assert page.sentence.startswith("No engine reached the noise floor in 3 evaluations")
    assert "significantly" not in page.sentence
    assert "raise --budget" in page.next_step


def test_one_engine_alone_is_compared_with_none():
    assert page_of(GP).sentence == "gp alone was run."
    assert "two engines or more" in page_of(GP).next_step


def test_names_are_not_taken_for_markup_and_every_table_is_there():
    text = page_html(page_of(GP, SOBOL), foot_of("compare"))
    assert "<script" not in text
    assert text.count("<table>") == 2
