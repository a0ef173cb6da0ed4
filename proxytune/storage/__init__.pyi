from .database import is_begun as is_begun
from .lock import locked as locked
from .own_files import FAMILIES as FAMILIES
from .records import State as State, SweepRecord as SweepRecord, TrialRecord as TrialRecord
from .repair import Salvage as Salvage, salvage as salvage
from .store import FILE_NAME as FILE_NAME, Store as Store
