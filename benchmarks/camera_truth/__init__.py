"""Blind sets: logs with frames whose truth is known and was not drawn by the model that is fitted to them."""

from camera_truth.cases import CASES, GEOMETRIC, LIGHT, OUTSIDE, PAIRS, TIMED, draw_case
from camera_truth.writing import Truth, write_set, write_truth

__all__ = ["CASES", "GEOMETRIC", "LIGHT", "OUTSIDE", "PAIRS", "TIMED", "Truth", "draw_case", "write_set", "write_truth"]
