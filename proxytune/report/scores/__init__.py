"""Usefulness from two tables of scores: JSON, table and figures."""
