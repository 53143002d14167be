"""What a network gets wrong of its own inputs, against effects hidden in drawn segments."""

from dataclasses import replace

import numpy as np
import pytest

from shiplog.diagnosis.linear.linear_segments import Linear, Path
from shiplog.diagnosis.linear.segment_nodes import conditions_at_nodes
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.diagnosis.noise import input_misfit, part_products
from shiplog.diagnosis.noise.campaign_parts import marginal
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.models.compiled_network import Network
from shiplog.voyages.rows.timescale import NODE_STEP, STEP_ROWS

NODES, BINS, STEP = 6, 5, 0.2
ROWS = round((NODES - 1) * NODE_STEP / STEP)
GRID = SegmentGrid(STEP, ROWS, ROWS // STEP_ROWS + 1, BINS, NODES)
NOISE = np.array([0.02, 0.01, 0.03, 0.015, 0.004, 0.002])
PROCESS_NOISE = ProcessNoise(NOISE, np.array([0.08, 0.05, 0.03]), 4.0, np.full(6, 1.7))


def network(features: int = 300) -> Network:
    """Two actuators and the wind; what it says itself is not asked."""
    rng = np.random.default_rng(0)
    return Network(
        weights=(rng.standard_normal((3, 7)), rng.standard_normal(3)),
        mean=np.zeros(7), std=np.ones(7), out_mean=np.zeros(3), out_std=np.ones(3),
        frequency=rng.standard_normal((7, features)) / 3.7,
        phase=rng.uniform(0.0, 6.0, features),
        wind=True, components=True, input_tanh=False,
    )  # fmt: skip


def segments(count: int, seed: int = 0) -> Cut:
    """Ships that do something else in each segment, in wind that goes with the heading's sine."""
    rng = np.random.default_rng(seed)
    y = np.repeat(rng.standard_normal((count, 1, 6)), BINS, axis=1)
    driven = np.repeat(rng.standard_normal((count, 1, 5)), GRID.instants, axis=1)
    used = np.ones((count, BINS, 6), dtype=bool)
    return Cut(np.arange(count), y, used, driven, np.zeros(count, dtype=int), STEP)


def acceleration_of(cut: Cut, of) -> np.ndarray:
    """[S, 3J] of an acceleration `of` (state, driven) in sway."""
    nodes = conditions_at_nodes(cut, GRID)
    whole = np.zeros((len(cut), 3, NODES))
    whole[:, 1] = 0.2 * of(nodes.state, nodes.driven)
    return whole.reshape(len(cut), -1)


def bent(cut: Cut, hidden: np.ndarray, looks_like: np.ndarray, seed: int = 1) -> Linear:
    """Observations that a hidden acceleration bends, and one column of another."""
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((*cut.y.shape, 6 + 3 * NODES)) * NOISE[:, None] * 20.0
    e = np.einsum("sbcz,sz->sbc", z[..., 6:], hidden) + NOISE * rng.standard_normal(cut.y.shape)
    j = np.einsum("sbcz,sz->sbc", z[..., 6:], looks_like)[..., None]
    return Linear(cut, Path(np.zeros((len(cut), 6)), np.zeros((len(cut), 3, NODES))), e, z, j)


def nats(linear: Linear, own: input_misfit.Misfit | None) -> float:
    """Of the column, above nothing; of nominal process noise."""
    own_count = 0 if own is None else own.count
    total = part_products.whole(
        linear, PROCESS_NOISE, np.ones(1 + own_count),
        accelerations=None if own is None else own.accelerations(linear.cut, GRID),
    ).G  # fmt: skip
    known = np.eye(len(total) - 1)
    without = np.delete(np.delete(total, 1, 0), 1, 1)
    return marginal(total, known, np.zeros(len(known))) - marginal(
        without, known[1:, 1:], np.zeros(len(known) - 1)
    )


def learned(linear: Linear) -> input_misfit.Misfit:
    one = np.ones(1)
    return input_misfit.estimate(network(), linear, GRID, PROCESS_NOISE, one, one)


def test_what_it_bends_the_network_by_is_its_acceleration():
    cut = segments(40)
    hidden = acceleration_of(cut, lambda s, d: np.sin(s[..., 1]))
    own = learned(bent(cut, hidden, hidden))
    weights = np.random.default_rng(3).standard_normal(own.count)
    nodes, plain = conditions_at_nodes(cut, GRID), network()
    given = (nodes.state, nodes.driven[..., :2], nodes.driven[..., -2:])
    none = np.zeros(0)
    apart = plain.bend(own.bends(weights)).acceleration(none, *given) - plain.acceleration(
        none, *given
    )
    accelerations = (own.accelerations(cut, GRID) @ weights).reshape(len(cut), 3, NODES)
    assert np.moveaxis(accelerations, 1, -1) == pytest.approx(np.asarray(apart), abs=1e-9)
    twice = plain.bend(own.bends(weights)).bend(own.bends(weights))
    assert twice.bent == pytest.approx(2.0 * own.bends(weights))
    assert plain.bend(np.zeros((0, 3))) is plain
    with pytest.raises(ValueError, match="72"):
        plain.bend(np.ones((72, 3)))


def test_a_misfit_of_the_inputs_speaks_for_no_cause_that_looks_like_it():
    """Hidden: a force of the speed. A column that goes with the rudder and a little with that
    speed gets hundreds of nats from it, of a process noise of seconds; conditional on
    the misfit a few."""
    cut = segments(150)
    hidden = acceleration_of(cut, lambda s, d: np.sin(s[..., 1]))
    column = acceleration_of(cut, lambda s, d: d[..., 0] + 0.5 * s[..., 1])
    given = bent(cut, hidden, column)
    assert nats(given, None) > 200.0
    assert nats(given, learned(given)) < 20.0


def test_what_the_network_cannot_see_is_still_named_with_it():
    """Hidden: the force of the speed, and one of the place."""
    cut = segments(150)
    place = acceleration_of(cut, lambda s, d: np.tanh(s[..., 0]))
    hidden = acceleration_of(cut, lambda s, d: np.sin(s[..., 1])) + 0.5 * place
    given = bent(cut, hidden, place)
    own = learned(given)
    assert nats(given, own) > 50.0
    still = bent(cut, acceleration_of(cut, lambda s, d: np.sin(s[..., 1])), place)
    assert nats(still, learned(still)) < 5.0


def test_it_keeps_what_voyages_say_something_of():
    """Of ships that hardly do anything a sum or two of the features, whatever their number."""
    near = segments(60)
    slow = replace(near, y=0.02 * near.y, driven=0.02 * near.driven)
    much, little = (
        learned(
            bent(
                cut,
                acceleration_of(cut, lambda s, d: s[..., 1]),
                acceleration_of(cut, lambda s, d: d[..., 0]),
            )
        )
        for cut in (near, slow)
    )
    assert 0 < little.count < 0.25 * much.count
