"""Noise of the paper's size on noisy copies, and random streams that do not disturb each other."""

import math

import numpy as np
import polars as pl
import pytest
import torch

from shiplog.training.network.jittering import jittered
from shiplog.training.settings import random_streams
from shiplog.voyages.windows.windows import Windows


def still(copies, size=100):
    """Windows of a ship at rest; each is the copy of that number."""
    count, rng = len(copies), np.random.default_rng(0)
    plan, driven = pl.DataFrame({"copy": copies}), rng.normal(size=(count, size, 2))
    return Windows(plan, np.zeros((count, size, 6)), driven, driven, np.ones((count, size - 1)))


def test_jitter_has_the_papers_size_and_touches_velocities_of_copies_only():
    clean = still([*range(1, 11)] * 18)
    noisy = jittered(clean, random_streams.generator(0, "jitter"))
    assert not noisy.state[..., [0, 2, 4]].any()
    spread = noisy.velocity.reshape(-1, 3).std(0)
    assert spread == pytest.approx([0.01, 0.01, math.radians(0.1)], rel=0.02)
    assert noisy.actuator is clean.actuator and noisy.wind is clean.wind
    assert (noisy.velocity[0] != noisy.velocity[1]).all()
    mixed = jittered(still([0, 1]), random_streams.generator(0, "jitter"))
    assert not mixed.state[0].any() and mixed.velocity[1].all()


def test_the_noise_of_a_seed_is_always_the_same():
    """A run trained again is the same run: figures of the stream of seed 0, written down once."""
    noisy = jittered(still([1], 2), random_streams.generator(0, "jitter")).velocity[0]
    normal = [
        [-0.29623294873329986, 0.49579234329157384, 0.09013456467733817],
        [1.232638252712301, 0.9582167613800492, 0.4677767913971633],
    ]
    assert noisy / [0.01, 0.01, math.radians(0.1)] == pytest.approx(np.array(normal), rel=1e-12)


def test_streams_are_by_seed_and_purpose():
    def draw(seed, purpose):
        return tuple(torch.rand(3, generator=random_streams.generator(seed, purpose)).tolist())

    draws = {(s, p): draw(s, p) for s in (0, 1) for p in ("jitter", "weights")}
    assert len(set(draws.values())) == 4
    assert draws[0, "jitter"] == draw(0, "jitter")
