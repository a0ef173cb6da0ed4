"""The figures of a diagnosis: what the declared model leaves over, why, and what the added effects are worth."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from proxytune.diagnosis import Diagnosis
from proxytune.report.diagnosis.effect_figure import effect_curve
from proxytune.report.diagnosis.error_figure import error_figure
from proxytune.report.diagnosis.learnt_figure import learnt_figure
from proxytune.report.diagnosis.ranking_figure import ranking_figure
from proxytune.report.diagnosis.residual_figure import residual_map, residual_over_time, strayed


def diagnosis_figures(diagnosis: Diagnosis) -> Mapping[str, Figure]:
    """Draw everything that a diagnosis has to show, by the name of the figure.

    What has nothing to show is left out: the curve of an effect where none was added and no signal explains anything,
    the learnt curves where none are used.
    """
    both = strayed(diagnosis)
    figures = {
        "residual_over_time": residual_over_time(diagnosis.parts.tested, both),
        "residual_map": residual_map(diagnosis.parts.tested, both),
        "ranking": ranking_figure(diagnosis.found),
        "effect_curve": effect_curve(diagnosis),
        "learnt": learnt_figure(diagnosis.learning),
        "error": error_figure(diagnosis),
    }
    return {name: figure for name, figure in figures.items() if figure is not None}
