"""Differential-drive robots on a road: plants, cameras, lanes, agents and the lane-following task."""
