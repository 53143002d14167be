"""Segments: where they lie, what a bin is, and what drives between instants."""

from dataclasses import replace

import closed
import numpy as np
import pytest
from toy_ship import GRID, RECORD, ROWS

from shiplog.diagnosis.linear import segment_nodes, segments
from shiplog.diagnosis.linear.measurement_correction import as_hypothesised, water
from shiplog.diagnosis.noise import discrepancy
from shiplog.models.causes import Current, WindForce
from shiplog.voyages.rows.timescale import STEP_ROWS


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


def test_the_discrepancy_sees_the_motion_through_the_water_and_the_wind_over_it():
    """A ship that drifts with a current is still in the water, and the wind that it feels is what
    an anemometer shows, whatever the water does."""
    heading = 0.7
    north, east = 0.3, -0.2
    drift = np.array([
        0.0, north * np.cos(heading) + east * np.sin(heading),
        0.0, east * np.cos(heading) - north * np.sin(heading), heading, 0.0,
    ])  # fmt: skip
    cut = segments.cut(replace(RECORD, state=np.tile(drift, (len(RECORD), 1))), ROWS)
    driven = cut.driven.copy()
    over_ground = segment_nodes.conditions_at_nodes(cut, GRID)
    wet = segment_nodes.conditions_at_nodes(replace(cut, water=np.array([north, east])), GRID)
    assert wet.state[..., [1, 3, 5]] == pytest.approx(np.zeros((4, GRID.nodes, 3)), abs=1e-12)
    assert wet.state[..., [0, 2, 4]] == pytest.approx(over_ground.state[..., [0, 2, 4]])
    assert wet.driven[..., -2:] - over_ground.driven[..., -2:] == pytest.approx(
        np.tile((north, east), (4, GRID.nodes, 1))
    )
    assert discrepancy.apparent_flow(wet) == pytest.approx(discrepancy.apparent_flow(over_ground))
    assert (cut.driven == driven).all()


def test_the_water_is_the_sum_of_the_causes_that_move_it():
    causes = (Current(), WindForce())
    numbers = {"current": np.array([0.3, -0.2]), "wind_force": np.array([0.2, 0.0, -0.1])}
    assert water(causes, numbers).tolist() == [0.3, -0.2]
    assert water(causes, {}).tolist() == [0.0, 0.0]
    found = as_hypothesised(segments.cut(RECORD, ROWS), causes, numbers)
    assert found.water.tolist() == [0.3, -0.2]
    assert found.factors["wind"] == pytest.approx([1.2, 1.0, 0.9])


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
    share = RECORD.share[ROWS[1] + STEP_ROWS * np.arange(GRID.instants)]
    assert cut.driven[1, 1:, 2] == pytest.approx(share[1:], abs=1e-12)
    assert cut.driven[1, :, 3:] == pytest.approx(np.tile(closed.TRUE_WIND, (151, 1)), abs=1e-12)
    spike = np.zeros((len(RECORD), 2))
    spike[11] = 1.0  # between nodes 5 and 6
    found = segments.cut(replace(RECORD, actuator=spike), ROWS).driven[0, :, 0]
    assert found[[4, 5, 6, 7]].tolist() == [0.0, 0.25, 0.25, 0.0]
