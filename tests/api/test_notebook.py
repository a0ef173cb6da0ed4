"""Every command has a function of its own, and what it returns shows itself in a notebook: a sentence and a table."""

import inspect

import pandas as pd
import pytest

import proxytune
from proxytune.cli.commands import COMMANDS

CALLED = {"study": "run_study", "sweep": "run_sweep", "loop": "run_loop", "import": "import_log", "plot": "read_study"}
"""Where a function is not called as its command."""
FOR_FILES = {"new", "repair", "list", "completion", "record"}
"""Commands that write files to start from or mend, or tell what there is."""
REPORTS = [
    name for name in proxytune.__all__ if name.endswith(("Report", "Prediction", "Measurement", "DrivenEpisode"))
]


@pytest.mark.parametrize("command", sorted(set(COMMANDS) - FOR_FILES))
def test_every_command_has_a_function(command):
    assert inspect.isfunction(getattr(proxytune, CALLED.get(command, command)))


@pytest.mark.parametrize("name", [*REPORTS, "Assessment"])
def test_every_report_can_show_itself_in_a_notebook(name):
    assert inspect.isfunction(getattr(proxytune, name)._repr_html_)


def test_reports_also_of_a_sweep_show_sentence_tables_and_figures_and_what_hangs_at_them_a_line(finished, make_study):
    report = proxytune.read_study(finished)
    page = report._repr_html_()
    assert report.sentence[:12] in page
    assert "<table" in page
    assert page.count("<svg") == len(report.figures())
    table = pd.DataFrame({"agent": list("abc"), "way": [1.0, 2.0, 3.0]})
    found = proxytune.score(proxy=table, target=table, metrics="way:max")
    assert found.table().loc["PRPV", "value"] == 0
    assert "<table" in found._repr_html_()
    # A prompt shows a line, not every score.
    for one in (report.best, report.best.assessment, report.result):
        assert len(repr(one)) < 300
        assert "\n" not in repr(one)
    assert all(f"{name}={value:.4g}" in repr(report.best) for name, value in report.theta.items())
    assert f"PRPV {report.best.assessment.prpv.value}" in repr(report.best.assessment)
    report = proxytune.run_sweep(make_study(), "trim", points=3, at="nominal")
    assert list(report.tables()["trim"].index) == [-0.3, 0.0, 0.3]
    page = report._repr_html_()
    assert "<table" in page
    assert "<svg" in page


@pytest.mark.parametrize(
    "name",
    ["StudyReport", "DiagnosisReport", "ScoreReport", "SweepReport", "TeachReport", "FamiliesReport", "LoopReport"],
)
def test_every_report_of_a_page_gives_page_figures_and_a_table(name):
    """What a command writes can be had from Python by the same names everywhere."""
    for method in ("page", "figures", "to_frame"):
        assert inspect.isfunction(getattr(getattr(proxytune, name), method))
