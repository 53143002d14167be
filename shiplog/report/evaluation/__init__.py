"""Errors of models as tables and sentences."""
