"""Prediction over windows: errors, floor, repeats, and parameters polished on them."""
