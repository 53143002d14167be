"""Sensors that contradict each other grossly, found by counting, before any fit."""
