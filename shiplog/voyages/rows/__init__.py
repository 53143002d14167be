"""Rows of a grid: samples between which is interpolated, faults of a channel, 1 Hz means."""
