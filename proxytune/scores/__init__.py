"""Score tables: how well each agent did, episode by episode, and the metrics that judge it."""

from proxytune.scores.cells import column_names
from proxytune.scores.files import read_domains, read_scores, write_scores
from proxytune.scores.metric import ROUNDING, Array, Metric, varies
from proxytune.scores.table import ScoreTable

__all__ = [
    "ROUNDING",
    "Array",
    "Metric",
    "ScoreTable",
    "column_names",
    "read_domains",
    "read_scores",
    "varies",
    "write_scores",
]
