"""Usefulness along one parameter: the curves and what they show."""
