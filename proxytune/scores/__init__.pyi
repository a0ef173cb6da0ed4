from .cautions import score_cautions as score_cautions
from .forms import (
    LABELS as LABELS,
    Side as Side,
    agent_column as agent_column,
    both_metrics as both_metrics,
    check_sides as check_sides,
    expand as expand,
)
from .reading import (
    column_names as column_names,
    read_domains as read_domains,
    read_scores as read_scores,
    write_scores as write_scores,
)
from .table import ROUNDING as ROUNDING, Metric as Metric, ScoreTable as ScoreTable, varies as varies
