"""Closing the loop: tune, diagnose, extend, tune again, and compare before with after."""
