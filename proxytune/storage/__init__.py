"""The folder of a study: study.db with its rows, and its lock.

store     Store, TrialRecord, SweepRecord, State, theta_json, is_begun, FILE_NAME: values in and out of study.db
folder    locked, refuse_links, FAMILIES, MADE: one process at a time, and no links that lead elsewhere
repair    salvage, Salvage: what is whole of a damaged study.db
database  its tables, its format, and the checks on opening; for this room alone
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
