"""Document, tables, figures and page of a sweep."""

import csv
import io
import json
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image
from readable import assert_readable, on_terminal

from proxytune.report import sweep
from proxytune.report.text import table_text
from proxytune.storage import Store
from proxytune.study import StudyRun, open_study
from proxytune.sweep import curve_of, discrepancy_study, plan_sweep, run_sweep, sweep_interval, with_target

TRUTH = {"trim": 0.1, "delay": 0.12}


def curve(folder, parameter="trim", base=TRUTH, model=None):
    study = open_study(folder)
    plan = plan_sweep(sweep_interval(study, parameter), base, 4)
    discrepancy = discrepancy_study(study, model) if model else None
    if discrepancy:
        plan = with_target(plan, model, discrepancy)
    with Store.open(folder) as store:
        run_sweep(StudyRun(study, store), plan, discrepancy)
        return curve_of(StudyRun(study, store), plan)


@pytest.fixture(scope="module")
def with_pod(make_studies):
    folder = make_studies("echo", family='"echo:echo"')
    (folder.parent / "truth.toml").write_text("trim = 0.1\ndelay = 0.12\n")
    return curve(folder, model=folder.parent / "truth.toml")


@pytest.fixture(scope="module")
def swept(make_studies):
    return curve(make_studies())


def test_document_and_csv_have_a_point_per_value_and_without_a_target_model_say_how_to_get_pod(swept):
    document = json.loads(json.dumps(sweep.curve_document(swept), allow_nan=False))
    assert document["parameter"] == "trim"
    assert document["base"] == TRUTH
    assert [point["value"] for point in document["points"]] == [-0.3, -0.1, 0.1, 0.3]
    assert document["points"][2]["prpv"] == 0
    assert document["noise_floor"] == swept.points[0].assessment.noise_floor.value
    assert document["noise_floor_kind"] == "halves"
    rows = list(csv.DictReader(io.StringIO(sweep.curve_csv(swept))))
    points = sweep.curve_document(swept)["points"]
    assert [float(row["trim"]) for row in rows] == [point["value"] for point in points]
    assert [int(row["prpv"]) for row in rows] == [point["prpv"] for point in points]
    assert [float(row["ppv"]) for row in rows] == [point["ppv"] for point in points]
    document = sweep.curve_document(swept)
    assert document["points"][0]["pod"] is None
    assert "--target-model" in document["notes"][0]
    assert not any("pod" in column for column in sweep.curve_csv(swept).splitlines()[0].split(","))


def test_the_name_is_short_and_has_one_mark_of_held_values_in_any_order(swept):
    names = [
        sweep.curve_name(replace(swept, base=base)) for base in (TRUTH, {**TRUTH, "delay": 0.2}, {"trim": 0.1}, {})
    ]
    assert names[0] == "sweep_trim_4e3f5b"
    assert len(names[1]) == len(names[0])
    assert names[1] != names[0]
    assert names[2:] == ["sweep_trim", "sweep_trim"]
    assert sweep.held_mark({"trim": 1, "delay": 0.12}) == sweep.held_mark({"delay": 0.12, "trim": 1.0})
    assert sweep.held_mark({"trim": 1.0}) != sweep.held_mark({"trim": 0.1})


def test_people_see_a_row_per_value(swept):
    shown = on_terminal(*map(table_text, sweep.curve_tables(swept)), width=80)
    rows = [line for line in shown.splitlines() if line.strip().startswith("0.1 ")]
    assert len(rows) == 2, "one row in each of the two tables"
    assert "…" not in shown, "all fits eighty columns"
    assert all(name in shown for name in ("PRPV", "PPV", "SRCC", "Kendall", "MMRV"))
    assert "POD" not in shown


def test_points_without_a_score_are_empty_and_told(make_study):
    broken = curve(make_study(domain={"faults": '["agent3:*:raises"]'}))
    assert sweep.curve_document(broken)["points"][0]["prpv"] is None
    assert sweep.curve_csv(broken).splitlines()[1] == "-0.3" + "," * (3 * 8) + ",3"
    assert sweep.say_failures([broken])[0].startswith("trim -0.3: agent 'agent3' failed from every start")
    for figure in (sweep.sweep_figure([broken]), sweep.panels_figure(broken), sweep.bars_figure([broken])):
        figure.draw_without_rendering()


def test_the_figure_shows_every_point_of_every_curve_within_its_axes(curves):
    panels = np.reshape(sweep.sweep_figure(curves).axes, (2, 2))
    for row, swept in enumerate(curves):
        line = next(line for line in panels[row, 0].get_lines() if line.get_label() == "PRPV")
        assert list(line.get_xdata()) == [point.value for point in swept.points]
        assert list(line.get_ydata()) == [point.assessment.prpv.value for point in swept.points]
        low, high = panels[row, 0].get_ylim()
        assert low <= min(line.get_ydata()) <= max(line.get_ydata()) <= high
    assert [panel.get_xlabel() for panel in panels[:, 0]] == ["trim", "delay [s]"]
    assert [panel.get_title() for panel in panels[0]] == ["PRPV [ordered pairs]", "PPV"]


def test_every_measure_is_in_document_csv_and_lines_with_its_interval(with_pod):
    document = sweep.curve_document(with_pod)
    point = document["points"][2]
    for measure in ("srcc", "kendall_tau", "mmrv"):
        assert set(point[measure]) == set(point["intervals"][measure]) == {"distance", "survival_time"}
    assert point["pod"]["pod_pose"] == {"value": 0.0, "interval": [0.0, 0.0], "unit": "m", "starts": 3}
    assert document["points"][0]["pod"]["pod_image"]["value"] > 0
    assert document["notes"] == []
    assert document["shapes"]["pod_pose"]["best"] == (0.1,)
    assert document["shapes"]["pod_pose"]["worsens_on_both_sides"] is True
    assert sweep.curve_name(with_pod) == "sweep_trim_4e3f5b_pod"

    rows = list(csv.DictReader(io.StringIO(sweep.curve_csv(with_pod))))
    for key in ("prpv", "ppv", "srcc_distance", "kendall_tau_distance", "mmrv_survival_time", "pod_pose", "pod_image"):
        assert all(float(row[f"{key}_low"]) <= float(row[f"{key}_high"]) for row in rows if row[f"{key}_low"])
        assert all(row[key] for row in rows)

    lines = sweep.curve_tables(with_pod)[0].notes
    assert len(lines) == 2 + 3 * 2 + 2
    assert lines[0].startswith("trim: PRPV: lowest (0) at 0.1")
    assert "worsens" in next(line for line in lines if "POD pose" in line)


def test_panels_show_each_measure_on_an_axis_of_its_own_and_pod_where_there_is_a_target_model(with_pod, swept):
    figure = sweep.panels_figure(with_pod)
    *panels, key, pose, image = figure.axes
    titles = ["PRPV [ordered pairs]", "PPV", "SRCC", "POD, pose [m]", "POD, image [full scale]"]
    assert [axes.get_title() for axes in (*panels, pose, image)] == titles
    assert [line.get_label() for line in panels[2].get_lines()][:2] == ["SRCC, distance", "SRCC, survival time"]
    for axes, measure in ((pose, "pod_pose"), (image, "pod_image")):
        assert list(axes.get_lines()[0].get_ydata()) == [point.pod[measure].value for point in with_pod.points]
    assert all(0.1 in line.get_xdata() for axes in panels for line in axes.get_lines()[-1:])
    assert not key.axison
    places = [axes.get_position().bounds for axes in figure.axes]
    assert len(set(places)) == len(places), "no second axis stands on another"
    assert [axes.axison for axes in sweep.panels_figure(swept).axes] == [True, True, True, False]


@pytest.mark.slow
def test_the_target_s_own_value_is_marked_only_where_it_is_known(swept):
    def marks(figure):
        return [line.get_xdata()[0] for axes in figure.axes for line in axes.get_lines() if line.get_label() == "truth"]

    assert marks(sweep.panels_figure(swept, {"trim": 0.11})) == [0.11] * 3
    assert marks(sweep.sweep_figure([swept], {"trim": 0.11})) == [0.11] * 2
    assert marks(sweep.panels_figure(swept)) == marks(sweep.sweep_figure([swept], {"delay": 0.1})) == []


@pytest.mark.slow
def test_figures_are_as_wide_as_a_column_with_type_of_six_points_and_more(with_pod, swept):
    many = sweep.sweep_figure([swept] * 4), sweep.bars_figure([swept] * 4)
    assert_readable(sweep.panels_figure(with_pod), sweep.panels_figure(swept), *many)


def test_the_bars_stand_at_the_held_value_and_beside_and_parameters_are_named_in_words(make_study, swept):
    values = [point.value for point in swept.points]
    indices, held = sweep.bar_points(swept)
    assert ([values[index] for index in indices], values[held]) == ([-0.1, 0.1, 0.3], 0.1)
    assert sweep.bar_points(curve(make_study("end"), base={"trim": -0.3})) == ([0, 1], 0)
    axes = sweep.bars_figure([swept]).axes[0]
    scores = [swept.points[index].assessment.prpv.value for index in indices]
    assert [patch.get_height() for patch in axes.patches if patch.get_width() == pytest.approx(0.85)] == scores
    assert (
        sweep.sweep_figure([replace(swept, parameter="camera_pitch", unit="deg")]).axes[1].get_xlabel()
        == "camera pitch [deg]"
    )
    assert [text.get_text() for text in sweep.bars_figure([swept]).axes[0].get_xticklabels()] == ["−0.1", "0.1", "0.3"]
    first = swept.points[0].assessment
    known = replace(first, noise_floor=replace(first.noise_floor, kind="same starts"))
    told = replace(swept, points=(replace(swept.points[0], assessment=known), *swept.points[1:]))
    assert legend(sweep.sweep_figure([told]))[0] == "noise floor"
    assert sweep.curve_document(told)["noise_floor_kind"] == "same starts"


def legend(figure):
    (told,) = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]
    return [text.get_text() for text in told.get_texts()]


def test_every_line_band_and_bar_is_explained_once_and_nothing_of_a_figure_is_clipped(with_pod, curves, make_study):
    lines = ["target's halves", "chance", "95 % interval", "held value"]
    assert legend(sweep.sweep_figure(curves)) == lines
    assert legend(sweep.panels_figure(with_pod)) == [*lines, "SRCC, distance", "SRCC, survival time"]
    assert sorted(legend(sweep.bars_figure(curves))) == sorted([*lines, "lower and higher value"])
    for figure in (sweep.panels_figure(with_pod), sweep.bars_figure([with_pod]), sweep.sweep_figure([with_pod])):
        figure.draw_without_rendering()
        outer, inner = figure.bbox, figure.get_tightbbox().transformed(figure.dpi_scale_trans)
        assert outer.x0 <= inner.x0
        assert inner.x1 <= outer.x1
        assert outer.y0 <= inner.y0
        assert inner.y1 <= outer.y1


@pytest.fixture(scope="module")
def curves(make_studies):
    folder = make_studies("swept")
    return [curve(folder), curve(folder, "delay")]


def view_of(curves):
    image = BytesIO()
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(image, format="png")
    figures = {name: image.getvalue() for name in (*map(sweep.curve_name, curves), "sweep_all_x", "sweep_bars_x")}
    return sweep.sweep_view("s", curves, figures, "The others are nominal")


def test_the_answer_says_where_prpv_is_lowest_and_of_a_flat_curve_claims_no_optimum(curves):
    answer = view_of(curves).sentence
    assert "trim: PRPV is lowest (0) at 0.1, and worse beyond noise at" in answer
    assert answer.endswith("The others are nominal.")
    titles = [part.title for part in view_of(curves).parts]
    assert titles[:3] == ["All parameters", "How much each parameter matters", "Usefulness along trim"]
    assert titles[3] == "Along trim: the paper's measures"
    assert titles.index("Along trim: other measures") < titles.index("Usefulness along delay")
    (trim, _) = curves
    point = trim.points[0]
    page = view_of([replace(trim, points=(point, replace(point, value=0.2)))])
    assert "and at no other value worse beyond noise" in page.sentence
    assert page.next_step.startswith("raise starts, or add agents whose scores change with trim")
    assert "search all parameters" in view_of(curves).next_step
