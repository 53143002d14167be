"""A trial of three short voyages, and what is asked of it; at the top, so that a cluster's
processes find it."""

from dataclasses import replace

import numpy as np

from shiplog.diagnosis.hypotheses import as_it_stands, evidence
from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.noise import on_off
from shiplog.diagnosis.noise.on_off import Course
from shiplog.diagnosis.noise.remainder import INTERMITTENT, RAISED, Remainder
from shiplog.diagnosis.trial import setup, trial_voyages
from shiplog.training.runs import load_model
from shiplog.voyages.store.store import Store

NAMES = ("trip_1", "trip_2", "trip_3")
CURRENT = {"current": np.array([0.05, -0.02])}
RAISES = Remainder(RAISED, noisy=True, channels=(1.5, 1.0, 0.8), noise_lasts=1.2)


def trial_of(run, store):
    """Of a given model: no nominal campaign."""
    run, store = load_model.load(run), Store(store)
    recorded = trial_voyages.record_of(store, NAMES, store.profile(NAMES))
    _, recorded = trial_voyages.rescale_time(run, None, recorded)
    return setup.trial_of(run, None, recorded, []).trial


def asked(trial):
    """Whatever a search asks of a trial, as one list of arrays: paths, weights, evidence, products
    with and without a voyage, residuals."""
    trial, point = as_it_stands.begin(trial, {})
    found = [point.path.start, point.path.acceleration, trial.weight, point.linear.lost]
    near = trial.linearise(CURRENT, point, 1.3)
    again = trial.linearise(CURRENT, near.path, 1.3, RAISES)
    there = trial.linearise_about(CURRENT, near.path)
    found += [trial.products.total(there, 1.2, trial.weight, Remainder()).G]
    found += [again.path.start, again.path.acceleration, np.array(again.linear.farthest)]
    rows = trial.rows
    course = Course(((int(rows[1]), int(rows[2]) + 40),), -1.0)
    pushed = Remainder(INTERMITTENT, intermittent=(0.0, 0.02, 0.001), course=course)
    for remainder in (Remainder(), RAISES, pushed, Remainder("position", size=2.0)):
        for noise in (0.9, 1.1):
            total = trial.products.total(again, noise, trial.weight, remainder)
            found += [total.G, np.array(total.volume)]
        found += [one.G for one in trial.products.each_part(again, 1.1, trial.weight, remainder)]
        out = np.isin(trial.record.voyage[rows], [1])
        found.append(trial.products.leave_out(again, 1.1, trial.weight, remainder, out))
    for remainder in (Remainder(), RAISES, pushed):
        each = [trial.products.volume(trial.first, noise, trial.weight, remainder)
                for noise in (0.5, 2.0, 7.0)]  # fmt: skip
        assert len(set(each)) == 3
        found.append(np.array(each))
    base, over = evidence.scan(trial, again, trial.reference.model.causes[:3])
    found += [np.array([base.evidence, base.noise_factor, *(one.evidence for one in over)])]
    numbers = 0.1 * np.sqrt(np.arange(len(trial.reference.columns.unit)) % 3 + 0.0)
    numbers = numbers * trial.reference.columns.unit
    left = trial.noise_left(again, numbers)
    nominal = trial.reference.process_noise
    kept = trial.rows[trial.weight > 0.0]
    runs = on_off.runs(course.on, segment_nodes.rows_of_nodes(kept, trial.grid))
    force = np.array([0.0, 0.02, 0.001])
    noises = [nominal.times(1.3), RAISES.apply_to(nominal), replace(nominal, intermittent=force)]
    noises += [replace(one, intermittent=force, runs=runs) for one in noises]
    found.append(np.array([left.likelihood(one) for one in noises]))
    found += trial.force_across(again, numbers, 1.1, pushed)
    left, _ = trial.less_misfit(again.linear, np.zeros(len(trial.reference.columns.unit)))
    found += [left.e, left.z, left.j, left.cut.rows, trial.covering(again).e]
    half = replace(trial, weight=trial.weight * np.arange(len(rows)) / len(rows))
    found.append(half.products.total(again, 1.0, half.weight, Remainder()).G)
    return found


def refuse_different(ours, theirs):
    """Not one number is different, to the last bit."""
    assert len(ours) == len(theirs)
    for number, (one, other) in enumerate(zip(ours, theirs, strict=True)):
        assert one.shape == other.shape and one.tobytes() == other.tobytes(), number
