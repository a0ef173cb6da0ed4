"""The page of `sweep`."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from proxytune.report.page.foot import foot_of
from proxytune.report.page.rendering import html_of
from proxytune.report.sweep.document import curve_name
from proxytune.report.sweep.page import sweep_page
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study
from proxytune.sweep import curve_of, plan_sweep, run_sweep, sweep_interval

EVIL = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def curves(make_studies):
    folder = make_studies("swept")
    study = open_study(folder)
    with Store.open(folder) as store:
        run = StudyRun(study, store)
        plans = [plan_sweep(sweep_interval(study, name), {"trim": 0.1, "delay": 0.12}, 4) for name in ("trim", "delay")]
        for plan in plans:
            run_sweep(run, plan, None)
        return [curve_of(run, plan) for plan in plans]


def page_of(curves, study="s"):
    image = BytesIO()
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(image, format="png")
    figures = {name: image.getvalue() for name in (*map(curve_name, curves), "sweep_all_x", "sweep_bars_x")}
    return sweep_page(study, curves, figures, "The others are nominal", foot_of("sweep"))


def test_the_answer_says_where_prpv_is_lowest_and_what_the_others_are_held_at(curves):
    answer = page_of(curves).answer
    assert "trim: PRPV is lowest (0) at 0.1, and worse beyond noise at" in answer
    assert answer.endswith("The others are nominal.")


def test_figures_of_all_come_first_then_each_parameter_with_its_tables(curves):
    titles = [part.title for part in page_of(curves).parts]
    assert titles[:3] == ["All parameters", "How much each parameter matters", "Usefulness along trim"]
    assert titles[3] == "Along trim: the paper's measures"
    assert titles.index("Along trim: other measures") < titles.index("Usefulness along delay")


def test_a_flat_curve_asks_for_more_starts_and_claims_no_optimum(curves):
    (trim, _) = curves
    point = trim.points[0]
    flat = replace(trim, points=(point, replace(point, value=0.2)))
    page = page_of([flat])
    assert "and at no other value worse beyond noise" in page.answer
    assert page.following.startswith("raise starts, or add agents whose scores change with trim")
    assert "search all parameters" in page_of(curves).following


def test_names_are_not_taken_for_markup(curves):
    assert "<script" not in html_of(page_of([replace(curves[0], unit=EVIL)], EVIL))
