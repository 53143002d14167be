"""The dynamic models by name. To add one: a file here and a line in MODELS."""

from __future__ import annotations

from shiplog.models.feedforward import FeedForward

MODELS = {"feedforward": FeedForward}
