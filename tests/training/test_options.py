"""Options of `train`: how many seeds a model has a use for."""

import pytest

from shiplog.training.options import TrainOptions


@pytest.mark.parametrize(("model", "left"), [("mmg", 1), ("hybrid", 3), ("feedforward", 3)])
def test_seeds_that_draw_nothing_are_left_out_and_reported(model, left, caplog):
    caplog.set_level("INFO")
    options = TrainOptions(model=model, seeds=3, window=50).without_idle_seeds()
    assert (options.seeds, options.window, options.model) == (left, 50, model)
    assert len(caplog.records) == (left == 1)


def test_one_seed_is_no_matter_to_report(caplog):
    caplog.set_level("INFO")
    one = TrainOptions(model="mmg")
    assert one.without_idle_seeds() == one and not caplog.records
