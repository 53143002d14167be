"""What the figures of the paper say in words."""

import math

import polars as pl

from shiplog.report.paper import figures


def test_a_seed_that_diverged_is_counted_below_its_set(tmp_path):
    losses = pl.DataFrame(
        {
            "set": ["ref", "ref", "ref", "sli2xjit2"],
            "seed": [0, 1, 2, 0],
            "loss": [100.0, math.inf, math.nan, 50.0],
        }
    )
    figures.test(losses, {"holds the velocity": 500.0}, tmp_path / "test_loss")
    drawn = (tmp_path / "test_loss.svg").read_text(encoding="utf-8")
    assert drawn.count("2 diverged") and drawn.count(" diverged") == 1
    assert "sli2 × jit2" in drawn
