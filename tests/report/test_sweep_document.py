import csv
import io
import json

import numpy as np
import pytest
from rich.console import Console

from proxytune.report.sweep_document import curve_csv, curve_document, curve_name, curve_table, failures
from proxytune.report.sweep_figure import sweep_figure
from proxytune.study.progress import Silent
from proxytune.study.store import Store
from proxytune.study.study import open_study
from proxytune.study.sweep import curve_of, plan_sweep, run_sweep, sweep_interval

TRUTH = {"trim": 0.1, "delay": 0.12}


def curve(folder, parameter="trim", base=TRUTH):
    study = open_study(folder)
    plan = plan_sweep(sweep_interval(study, parameter), base, 4)
    with Store.open(folder) as store:
        run_sweep(study, store, plan, Silent())
        return curve_of(study, store, plan)


@pytest.fixture
def swept(make_study):
    return curve(make_study())


def test_the_document_is_plain_json_with_a_point_per_value(swept):
    document = json.loads(json.dumps(curve_document(swept), allow_nan=False))
    assert document["parameter"] == "trim"
    assert document["base"] == TRUTH
    assert [point["value"] for point in document["points"]] == [-0.3, -0.1, 0.1, 0.3]
    assert document["points"][2]["prpv"] == 0
    assert document["noise_floor"] == swept.points[0].assessment.noise_floor.value


def test_the_csv_says_the_same_and_reads_back(swept):
    rows = list(csv.DictReader(io.StringIO(curve_csv(swept))))
    points = curve_document(swept)["points"]
    assert [float(row["trim"]) for row in rows] == [point["value"] for point in points]
    assert [int(row["prpv"]) for row in rows] == [point["prpv"] for point in points]
    assert [float(row["ppv"]) for row in rows] == [point["ppv"] for point in points]


def test_the_name_says_what_the_others_are_held_at(swept, make_study):
    assert curve_name(swept) == "sweep_trim_delay=0.12"
    assert curve_name(curve(make_study("nominal"), base={})) == "sweep_trim"


def test_people_see_a_row_per_value(swept):
    console = Console(width=100)
    with console.capture() as captured:
        console.print(curve_table(swept))
    assert len(captured.get().splitlines()) == 2 + 4


def test_points_without_a_score_are_empty_and_told(make_study):
    broken = curve(make_study(domain={"faults": '["agent3:*:raises"]'}))
    assert curve_document(broken)["points"][0]["prpv"] is None
    assert curve_csv(broken).splitlines()[1] == "-0.3,,,,,3"
    assert failures([broken])[0].startswith("trim -0.3: agent 'agent3' failed from every start")
    sweep_figure([broken])


def test_the_figure_shows_every_point_of_every_curve_within_its_axes(make_study):
    folder = make_study()
    curves = [curve(folder), curve(folder, "delay")]
    panels = np.reshape(sweep_figure(curves).axes, (2, 2))
    for column, swept in enumerate(curves):
        line = next(line for line in panels[0, column].get_lines() if line.get_label() == "PRPV")
        assert list(line.get_xdata()) == [point.value for point in swept.points]
        assert list(line.get_ydata()) == [point.assessment.prpv.value for point in swept.points]
        low, high = panels[0, column].get_ylim()
        assert low <= min(line.get_ydata()) <= max(line.get_ydata()) <= high
    assert [panel.get_xlabel() for panel in panels[1]] == ["trim", "delay [s]"]
    assert [row[0].get_ylabel() for row in panels] == ["PRPV [ordered pairs]", "PPV"]
