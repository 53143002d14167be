"""The dynamic models by name. To add one: a file here and a line in MODELS."""

from __future__ import annotations

MODELS = {
    "feedforward": "the paper's network, from the velocities, actuators and apparent wind",
    "mmg": "hull, screws, rudders and wind on a rigid body, identified from the logs",
    "hybrid": "the mmg and a small residual network that fades outside its training data",
}
