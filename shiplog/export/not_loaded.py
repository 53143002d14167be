"""Why a file was not loaded by the program that it is for."""

from __future__ import annotations


class NotLoaded(Exception):
    """The consumer is not here, or nothing of it runs without its own installation."""
