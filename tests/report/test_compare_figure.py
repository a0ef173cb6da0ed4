from proxytune.report.compare_document import compare_document, compare_lines, verdict
from proxytune.report.compare_figure import compare_figure
from proxytune.search.comparison import Run, RunKey
from proxytune.search.summary import Estimate, summarise


def runs(engine, *curves):
    return [
        Run(RunKey("o", engine, seed, len(curve), 2, ""), tuple(curve), (0.0,), curve[-1], 0.1, 0.5)
        for seed, curve in enumerate(curves)
    ]


GP = runs("gp", [9.0, 4.0, 0.0], [8.0, 3.0, 0.0])
SOBOL = runs("sobol", [9.0, 8.0, 8.0], [8.0, 8.0, 9.0])


def test_every_engine_has_its_median_and_the_floor_is_drawn():
    (axes,) = compare_figure([GP, SOBOL], 1.0).axes
    drawn = {line.get_label(): line for line in axes.get_lines()}
    assert list(drawn["gp (2 seeds)"].get_ydata()) == [8.5, 3.5, 0.0]
    assert list(drawn["sobol (2 seeds)"].get_ydata()) == [8.5, 8.0, 8.0]
    assert list(drawn["noise floor"].get_ydata()) == [1.0, 1.0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("evaluations", "lowest regret so far [ordered pairs]")


def test_a_verdict_needs_an_interval_clear_of_zero():
    found = summarise(SOBOL, GP, 1.0)
    cases = {(0.5, 3.0): "in fewer", (-3.0, -0.5): "in more", (-0.5, 3.0): "no fewer"}
    for (low, high), expected in cases.items():
        vars_ = {**vars(found), "saved": Estimate(1.0, low, high)}
        assert expected in verdict(type(found)(**vars_))


def test_the_document_names_the_default_and_gives_every_engine_a_verdict():
    summaries = [summarise(group, GP, 1.0) for group in (GP, SOBOL)]
    document = compare_document("analytic", summaries, 3, 1.0)
    assert document["default"] == "gp"
    assert [row["verdict"] for row in document["engines"]] == [
        "is the default",
        "reaches the noise floor in fewer evaluations",
    ]
    assert document["engines"][1]["saved"] == {"value": 1.0, "low": 1.0, "high": 1.0}
    assert compare_lines(summaries)[0] == "gp reaches the noise floor in fewer evaluations than sobol"
