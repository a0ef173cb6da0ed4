from .reading import column_names as column_names, read_domains as read_domains, read_scores as read_scores, write_scores as write_scores
from .table import Metric as Metric, ROUNDING as ROUNDING, ScoreTable as ScoreTable, varies as varies
