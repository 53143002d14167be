"""Options of `train`: how many seeds a model has a use for, and how short a window may be."""

import pytest

from shiplog.exceptions import UsageError
from shiplog.training.settings.options import TrainOptions


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


def test_a_window_in_which_no_velocities_can_be_compared_is_refused():
    TrainOptions(window=6).check()
    with pytest.raises(UsageError, match="A window of 5 s is too short") as refused:
        TrainOptions(window=5).check()
    assert refused.value.hint == "choose --window 6 or longer."


@pytest.mark.parametrize(
    ("model", "name", "least"),
    [("feedforward", "seeds", 1), ("feedforward", "width", 1), ("feedforward", "epochs", 1),
     ("mmg", "seeds", 1), ("mmg", "folds", 0)],
)  # fmt: skip
def test_numbers_that_a_command_refuses_are_refused_in_python_too(model, name, least):
    """A run without a seed has no model, and ended in a traceback after it was begun."""
    TrainOptions(model=model, **{name: least}).check()
    with pytest.raises(UsageError, match=f"--{name} {least - 1} is too small") as refused:
        TrainOptions(model=model, **{name: least - 1}).check()
    assert refused.value.hint == f"give {least} or more."
