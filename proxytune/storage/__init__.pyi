from .folder import FAMILIES as FAMILIES, MADE as MADE, locked as locked
from .repair import salvage as salvage
from .store import (
    FILE_NAME as FILE_NAME,
    State as State,
    Store as Store,
    SweepRecord as SweepRecord,
    TrialRecord as TrialRecord,
    is_begun as is_begun,
)
