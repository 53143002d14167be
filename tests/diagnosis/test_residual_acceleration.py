"""The posterior against kriging written the other way round, and against forces we put in."""

from dataclasses import replace

import afloat
import numpy as np
import pytest

from shiplog.diagnosis.linear import segments
from shiplog.diagnosis.linear.linear_segments import Linear, Path
from shiplog.diagnosis.linear.segments import Cut
from shiplog.diagnosis.noise import residual_acceleration
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.models.mmg import body
from shiplog.voyages.rows.recording import Record

PROCESS_NOISE = ProcessNoise(
    noise=np.full(6, 3e-4), acceleration=np.array([2e-3, 1e-3, 4e-4]), time=5.0, start=np.ones(6)
)


def rested(lengths: tuple[int, ...], voyages: tuple[int, ...]) -> Record:
    """A ship that lies still, in stretches of so many rows, each of a voyage."""
    count, names = sum(lengths), tuple("abcdef"[: max(voyages) + 1])
    starts = np.zeros(count, dtype=bool)
    starts[np.cumsum((0, *lengths))[:-1]] = True
    voyage = np.repeat(voyages, lengths)
    time = np.concatenate([0.1 * np.arange((voyage == v).sum()) for v in np.unique(voyage)])
    return Record(
        afloat.PROFILE, names, voyage, time, np.linspace(0.0, 1.0, count), starts,
        np.ones(count, dtype=bool), np.zeros((count, 6)), np.zeros((count, 3)),
        np.zeros((count, 2)),
    )  # fmt: skip


def observed_directly(y: np.ndarray, rows: np.ndarray) -> Linear:
    """Observations of the nodes themselves: [S, 3, J] as u, v, r of bins 0 to J - 2."""
    count, _, nodes = y.shape
    bins = nodes - 1
    e, z = np.zeros((count, bins, 6)), np.zeros((bins, 6, 6 + 3 * nodes))
    for channel, column in enumerate((1, 3, 5)):
        e[:, :, column] = y[:, channel, :bins]
        z[np.arange(bins), column, 6 + channel * nodes + np.arange(bins)] = 1.0
    used = np.zeros((count, bins, 6), dtype=bool)
    used[..., [1, 3, 5]] = True
    cut = Cut(rows, e, used, np.zeros((count, 1, 6)), np.zeros(count, dtype=int), 0.2)
    path = Path(np.zeros((count, 6)), np.zeros_like(y))
    j = np.zeros((count, bins, 6, 1))
    j[:, :, 1, 0] = 1.0  # a number that adds to every surge
    return Linear(cut, path, e, np.repeat(z[None], count, axis=0), j)


def test_the_posterior_is_kriging():
    """K (K + R)⁻¹ y, with the covariance K = σ² exp(-|t - t'|/τ) that the precision came from."""
    rng = np.random.default_rng(0)
    y = 1e-3 * rng.standard_normal((2, 3, 16))
    found = residual_acceleration.posterior(
        observed_directly(y, np.array([0, 300])),
        np.array([4e-4]),
        PROCESS_NOISE,
        rested((700,), (0,)),
    )
    t = 2.0 * np.arange(16)
    for channel in range(3):
        prior = PROCESS_NOISE.acceleration[channel] ** 2 * np.exp(
            -np.abs(t[:, None] - t) / PROCESS_NOISE.time
        )
        gain = prior[:, :15] @ np.linalg.inv(prior[:15, :15] + 3e-4**2 * np.eye(15))
        shifted = y[:, channel, :15] - (4e-4 if channel == 0 else 0.0)
        assert found.mean[:, channel] == pytest.approx(shifted @ gain.T, abs=1e-9)
        variance = np.diag(prior - gain @ prior[:15])
        assert found.sd[0, channel] == pytest.approx(np.sqrt(variance), rel=1e-4)
    assert found.time[1].tolist() == pytest.approx((30.0 + t).tolist())


def test_segments_cover_every_stretch_twice_and_to_its_end():
    record = rested((700, 299, 301, 650), (0, 0, 1, 1))
    rows = residual_acceleration.covering(record)
    # 299 rows hold no 30 s; 16 s on from a beginning there is another where 30 s are left
    assert rows.tolist() == [0, 160, 300, 399, 999, 1300, 1460, 1600, 1649]
    assert set(segments.begins(record)) <= set(rows.tolist())
    assert (record.firsts[rows] == record.firsts[rows + 300]).all()


def test_each_instant_counts_once_and_by_the_better_known():
    y = np.zeros((3, 3, 16))
    found = residual_acceleration.posterior(
        observed_directly(y, np.array([0, 300, 399])),
        np.zeros(1),
        PROCESS_NOISE,
        rested((700,), (0,)),
    )
    keep = residual_acceleration.unique_instants(found)
    rows = np.sort(found.rows[keep])
    assert np.diff(rows).min() >= 10  # nodes are 20 rows apart; no pair is nearer than half of it
    assert rows[0] == 0
    assert rows[-1] == 699
    assert not keep[0, 15]  # measured at the next segment's first node, here by nothing
    assert keep[1, 0]


def test_the_table_tells_what_went_with_it():
    record = rested((700,), (0,))
    state = record.state.copy()
    state[:, 0] = 100.0 + 0.05 * np.arange(700)  # means over 2 s of a line are the line
    state[:, 4] = 4.0
    wind = np.tile([3.0, -4.0], (700, 1))
    record = replace(record, state=state, wind=wind)
    linear = observed_directly(np.ones((2, 3, 16)) * 1e-3, np.array([0, 300]))
    table = residual_acceleration.table(
        residual_acceleration.posterior(linear, np.zeros(1), PROCESS_NOISE, record), record
    )
    assert table["time_s"].to_list() == pytest.approx([2.0 * i for i in range(31)])
    assert table["x0"][5] == pytest.approx(105.0)
    assert table["heading"][5] == pytest.approx(4.0 - 2.0 * np.pi)
    assert table["wind_starboard"][5] == pytest.approx(-4.0)
    assert table["share"][5] == pytest.approx(record.share[100])
    assert table["surge_acceleration"][5] == pytest.approx(1e-3, rel=0.1)
    assert {"rudder_port", "propeller", "yaw_acceleration_sd"} <= set(table.columns)


def test_a_force_that_no_model_has_is_found_with_its_uncertainty():
    """A force that swells and ebbs, through helm, wind and noise, by the project's own MMG."""
    sailed = afloat.voyage(150.0)
    swell = np.sin(2.0 * np.pi * sailed.time / 50.0)[:, None] * np.array([3.0, -2.0, 1.0])
    record = afloat.record(sailed, afloat.sailed_with(sailed, swell))
    white = replace(afloat.PROCESS_NOISE.times(10.0), noise=afloat.NOISE / np.sqrt(20.0))  # of 2 s
    found = residual_acceleration.posterior(afloat.linear(record), np.zeros(0), white, record)
    zero = np.zeros(1)
    added = body.accelerations(afloat.COEFFICIENTS, afloat.SHIP, zero, zero, zero, swell)
    true = np.moveaxis(np.asarray(added)[found.rows], -1, 1)
    z = (found.mean - true) / found.sd
    assert 0.6 < np.sqrt((z**2).mean()) < 1.2
    assert (np.abs(z) < 3.0).mean() > 0.98
    for channel in range(3):
        assert np.corrcoef(found.mean[:, channel].ravel(), true[:, channel].ravel())[0, 1] > 0.8
