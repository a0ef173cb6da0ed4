from .reading import column_names as column_names
from .reading import read_domains as read_domains
from .reading import read_scores as read_scores
from .reading import write_scores as write_scores
from .table import ROUNDING as ROUNDING
from .table import Metric as Metric
from .table import ScoreTable as ScoreTable
from .table import varies as varies
