"""Segments, and the model linearised about each."""
