"""Segments: where they lie, what a bin is, and what drives between nodes."""

from dataclasses import replace

import closed
import numpy as np
import pytest
from toy_ship import GRID, RECORD, ROWS

from shiplog.diagnosis import segments
from shiplog.voyages.timescale import NODE_ROWS


def test_segments_lie_end_to_end_within_stretches():
    starts = RECORD.starts.copy()
    starts[500] = True  # 50 s, then 70.1 s: one segment, then two
    found = segments.begins(replace(RECORD, starts=starts))
    assert found.tolist() == [0, 500, 800]
    assert segments.begins(RECORD).tolist() == [0, 300, 600, 900]
    assert len(segments.begins(RECORD.pick(["one"]))) == 4


def test_a_bin_is_the_mean_of_what_was_measured():
    """Of a ramp, its middle; of the heading, closed form: ∫ψ over two seconds."""
    cut = segments.cut(RECORD, ROWS)
    assert cut.y.shape == (4, 15, 6)
    t = 30.0 * np.arange(4)[:, None] + 2.0 * np.arange(15)
    ramp = replace(RECORD, state=np.outer(RECORD.time, np.ones(6)))
    middle = np.repeat((t + 1.0)[..., None], 6, -1)
    assert segments.cut(ramp, ROWS).y == pytest.approx(middle, abs=1e-9)
    whole = 0.4 + 0.02 * (t + 1.0) - 1.2 / 0.05 * (np.cos(0.05 * (t + 2)) - np.cos(0.05 * t)) / 2.0
    assert cut.y[..., 4] == pytest.approx(whole, abs=1e-5)
    assert cut.used.all() and cut.step == pytest.approx(0.2)


def test_bins_that_were_hardly_measured_do_not_count():
    viewed = np.ones(len(RECORD), dtype=bool)
    viewed[302:320] = False  # most of the first bin of the second segment
    viewed[325:330] = False  # a quarter of the next
    used = segments.cut(replace(RECORD, measured=viewed), ROWS).used
    assert not used[1, 0].any()
    assert used.sum() == used.size - 6


def test_what_drives_is_taken_between_nodes_too():
    """Actuators, share and true wind at the nodes, ¼ ½ ¼; a ramp is left as it is."""
    cut = segments.cut(RECORD, ROWS)
    share = RECORD.share[ROWS[1] + NODE_ROWS * np.arange(GRID.nodes)]
    assert cut.driven[1, 1:, 2] == pytest.approx(share[1:], abs=1e-12)
    assert cut.driven[1, :, 3:] == pytest.approx(np.tile(closed.TRUE_WIND, (151, 1)), abs=1e-12)
    spike = np.zeros((len(RECORD), 2))
    spike[11] = 1.0  # between nodes 5 and 6
    found = segments.cut(replace(RECORD, actuator=spike), ROWS).driven[0, :, 0]
    assert found[[4, 5, 6, 7]].tolist() == [0.0, 0.25, 0.25, 0.0]
