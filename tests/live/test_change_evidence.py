"""The evidence of a change, against the Gaussian likelihood written out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shiplog.live import evidence_file, kept
from shiplog.live.alarm import Alarm, Thresholds, Watcher
from shiplog.live.change_evidence import PART, ChangeEvidence
from shiplog.live.kept import KeptRows, Saved
from shiplog.live.segment_products import Directions

R, Q, CAUSES = 3, 2, {"one": np.array([0]), "two": np.array([1, 2])}
WIDTHS = (R, Q, 3)
OBSERVED = 7  # of a segment


def matrices(rng, count):
    """J of (β, γ, d) [S, n, N - 1], white noise of unit size."""
    return rng.normal(size=(count, OBSERVED, R + Q + 3))


def errors(rng, J, change=None, since=0):
    """e of segments with numbers of their own, and a change of d from one of them on."""
    gamma = rng.normal(size=Q)
    found = []
    for s, one in enumerate(J):
        if s % PART == 0:
            beta = rng.normal(size=R)
        z = np.concatenate((beta, gamma, np.zeros(3)))
        if change is not None and s >= since:
            z[R + Q :] = change
        found.append(one @ z + rng.normal(size=OBSERVED))
    return np.array(found)


def products(J, e):
    E = np.concatenate((e[..., None], J), -1)
    return np.einsum("sni,snj->sij", E, E)


def log_evidence(J, e, cause, since):
    """log N(e; 0, C) of all segments at once, a cause's numbers ~ N(0, I) from one on."""
    count = len(J)
    whole = np.eye(count * OBSERVED)
    blocks = [slice(s * OBSERVED, (s + 1) * OBSERVED) for s in range(count)]
    for a in range(count):
        for b in range(count):
            C = J[a][:, R : R + Q] @ J[b][:, R : R + Q].T
            if a // PART == b // PART:
                C = C + J[a][:, :R] @ J[b][:, :R].T
            if cause is not None and min(a, b) >= since:
                at = R + Q + cause
                C = C + J[a][:, at] @ J[b][:, at].T
            whole[blocks[a], blocks[b]] += C
    flat = e.reshape(-1)
    return -0.5 * flat @ np.linalg.solve(whole, flat) - 0.5 * np.linalg.slogdet(whole)[1]


@pytest.mark.parametrize("count", [5, 23], ids=["one part", "two parts"])
def test_a_bayes_factor_is_the_ratio_of_two_gaussian_likelihoods(count):
    rng = np.random.default_rng(count)
    J = matrices(rng, count)
    e = errors(rng, J, change=np.array([0.0, 1.0, -1.0]), since=count - 3)
    evidence = ChangeEvidence(WIDTHS, CAUSES)
    found = [evidence.add(H) for H in products(J, e)][-1]
    none = log_evidence(J, e, None, 0)
    # within the part that is being sailed any beginning counts, before it the parts' own
    last = PART * ((count - 1) // PART)
    begins = [*range(last, count), *range(0, last, PART)]
    for label, at in CAUSES.items():
        each = {k: log_evidence(J, e, at, k) - none for k in begins}
        best = max(each, key=lambda k: each[k])
        assert found.factors[label] == pytest.approx(each[best], abs=1e-6)
        assert found.began[label] == count - best


def test_without_a_change_the_statistic_is_no_more_than_one_on_average():
    """E Z_n ≤ 1 at any n: Ville's inequality then bounds how often it is large."""
    rng = np.random.default_rng(3)
    values = []
    for _ in range(100):
        J = 0.3 * matrices(rng, 8)
        evidence = ChangeEvidence(WIDTHS, CAUSES)
        values.append([math.exp(evidence.add(H).total) for H in products(J, errors(rng, J))])
    mean, scatter = np.mean(values, 0), np.std(values, 0) / math.sqrt(len(values))
    assert (mean <= 1.0 + 4.0 * scatter).all()
    assert mean[-1] > 0.1  # it is a statistic of the data, and not a small constant


def test_no_segment_decides_alone():
    rng = np.random.default_rng(4)
    J = matrices(rng, 1)
    H = products(J, J @ np.full(R + Q + 3, 30.0))[0]
    watcher = watching(change=5.0)
    assert watcher.evidence.alone(H) > 100.0
    assert watcher.add_product(H, 0) is None


def watching(change: float) -> Watcher:
    directions = Directions(np.zeros(1), np.zeros((1, R)), np.zeros((1, Q)), CAUSES, 1.0)
    return Watcher(directions, Thresholds(change, math.inf, False), median=5.0)


def sailed(change, since, count=40, seed=5):
    rng = np.random.default_rng(seed)
    J = matrices(rng, count)
    return products(J, errors(rng, J, change, since))


def test_an_alarm_names_what_changed_and_since_when():
    H = sailed(np.array([3.0, 0.0, 0.0]), 20)
    watcher = watching(change=6.0)
    alarms = [a for i, h in enumerate(H) if (a := watcher.add_product(h, i)) is not None]
    assert alarms and isinstance(alarms[0], Alarm)
    assert 20 <= alarms[0].time <= 30
    assert alarms[0].suspects[0].name == "one"
    assert abs(alarms[0].suspects[0].began - 19) <= 2
    assert watcher.stands and len(alarms) == 1  # it stands: the same words are not said again


def test_an_alarm_is_over_when_the_ship_is_itself_again():
    quiet = sailed(None, 0, count=60, seed=7)
    H = np.concatenate((sailed(np.array([0.0, 3.0, -3.0]), 0, count=12), quiet))
    watcher = watching(change=6.0)
    stood = []
    for i, h in enumerate(H):
        watcher.add_product(h, i)
        stood.append(watcher.stands)
    assert any(stood) and not stood[-1]
    assert watcher.named == "" and len(watcher.ends) < len(H) - 12


def test_a_watch_goes_on_from_its_file_as_if_it_had_not_ended(tmp_path):
    H = sailed(np.array([3.0, 0.0, 0.0]), 20, count=45)
    whole, first = watching(6.0), watching(6.0)
    for i, h in enumerate(H):
        whole.add_product(h, i)
    for i, h in enumerate(H[:27]):
        first.add_product(h, i)
    kept.save(tmp_path, Saved(evidence_file.facts(first), evidence_file.arrays(first)))
    after = watching(6.0)
    saved = kept.load(tmp_path)
    assert saved is not None and evidence_file.restore(after, saved.arrays, saved.facts)
    for i, h in enumerate(H[27:], 27):
        after.add_product(h, i)
    assert after.latest == whole.latest
    assert (after.named, after.quiet, after.ends) == (whole.named, whole.quiet, whole.ends)
    assert after.squares == whole.squares


def test_what_is_damaged_or_of_another_model_is_no_state(tmp_path):
    assert kept.load(tmp_path) is None
    (tmp_path / kept.STATE).write_bytes(b"half a fi")
    assert kept.load(tmp_path) is None
    assert not evidence_file.restore(watching(6.0), {"evidence_total": np.zeros((2, 2))}, {})


@pytest.mark.long
def test_memory_is_bounded():
    evidence = ChangeEvidence(WIDTHS, CAUSES)
    H, sizes = sailed(None, 0, count=PART), []
    for _ in range(53):
        for h in H:
            evidence.add(h)
        sizes.append(sum(one.nbytes for one in (*evidence.parts, *evidence.since)))
    assert sizes[-1] == sizes[49]


def outliers(at: list[int], count: int = 30) -> list[Alarm]:
    """Alarms of a watch of segments of which these have six times the χ² of the others, whatever
    the cause."""
    directions = Directions(np.zeros(1), np.zeros((1, R)), np.zeros((1, Q)), CAUSES, 1.0)
    watcher = Watcher(directions, Thresholds(math.inf, 1.0, False), median=5.0)
    H = np.zeros((count, 1 + sum(WIDTHS), 1 + sum(WIDTHS)))
    H[:, 0, 0] = 5.0
    H[at, 0, 0] = 30.0
    return [a for i, h in enumerate(H) if (a := watcher.add_product(h, i)) is not None]


def test_one_segment_that_nothing_explains_raises_no_alarm_and_three_in_a_row_do():
    assert outliers([5]) == outliers([5, 6]) == outliers([5, 6, 8, 9, 11]) == []
    (alarm,) = outliers([5, 6, 7])
    assert (alarm.time, alarm.unexplained, alarm.suspects) == (7, True, ())
    assert alarm.statistic == pytest.approx(math.log(6.0))


def test_kept_rows_are_of_the_last_hours(tmp_path):
    import polars as pl

    rows = KeptRows(tmp_path)
    for minute in range(0, 6 * 60, 10):
        times = pl.datetime_range(
            pl.datetime(2026, 1, 1) + pl.duration(minutes=minute),
            pl.datetime(2026, 1, 1) + pl.duration(minutes=minute, seconds=599.9),
            "5s", time_unit="ns", eager=True,
        )  # fmt: skip
        rows.add(pl.DataFrame({"time": times.dt.replace_time_zone("UTC"), "x0": 1.0}))
    table = rows.table(0)
    assert table is not None and table["time"].n_unique() == table.height
    hours = (table["time"][-1] - table["time"][0]).total_seconds() / 3600.0
    assert 3.9 <= hours <= 4.6
