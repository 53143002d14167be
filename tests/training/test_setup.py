"""What an identification begins with, in a sentence."""

from types import SimpleNamespace

import numpy as np

from shiplog.training.setup import Prepared


def test_the_sentence_counts_what_may_move():
    start = SimpleNamespace(names=("drag", "thrust", "lift"), source="a file")
    free = np.array([True, False, True])
    ready = Prepared(None, start, None, ["a", "a", "b", "b"], [], free, None)  # type: ignore[arg-type]
    rest = "of 3 parameters free, 4 windows, starting values from a file"
    assert ready.sentence(fit=True) == f"2 {rest}"
    assert ready.sentence(fit=False) == f"0 {rest}"
