"""A network that learned from the very voyages that are diagnosed, the whole way."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from pipelines.diagnosis.held_out import HeldOut
from pipelines.diagnosis.trial import record_of, trial_of, windows_of
from pipelines.known_ship import cases, sensors
from pipelines.prepare import ingest_logs
from pipelines.train import train_run
from shiplog import diagnose, runs
from shiplog.config import Config, Fast, Network, Split
from shiplog.exceptions import RunError
from shiplog.store import Store

SEED = 7101


@pytest.fixture(scope="module")
def afloat(tmp_path_factory):
    """Voyages in a current, and a small network of them that is trained for seconds."""
    work = tmp_path_factory.mktemp("network")
    (work / "logs").mkdir()
    case = cases.draw(SEED, cause="current", size=1.0, seconds=500)
    paths = []
    for leg in case.trial:
        paths.append(work / "logs" / f"{leg.name}.mcap")
        sensors.write_voyage(paths[-1], cases.voyage(case, leg), seed=leg.seed, start=leg.start)
    store = Store(work / "store")
    assert not ingest_logs(paths, "esso-vectwin", store).refused
    names = [leg.name for leg in case.trial]
    config = Config(
        recipe="fast", fast=Fast(warm_epochs=12, iterations=10), window=100,
        network=Network(width=24, depth=2, wind_input="components"),
        split=Split(training=tuple(names[1:]), validation=tuple(names[:1])),
    )  # fmt: skip
    run = train_run(config, store, work / "run")
    recorded = record_of(store, names, run.profile)
    trial, untested = trial_of(run, None, recorded, ())
    return SimpleNamespace(
        work=work, run=run, store=store, names=names, trial=trial, untested=untested,
        recorded=recorded, point=trial.begin({}),
    )  # fmt: skip


def test_what_only_renames_its_inputs_is_not_testable_beside_a_network(afloat):
    """Nor what any fit absorbs; what it cannot see is."""
    why = {
        "rudder_offset": "a network fitted to these voyages takes it in",
        "antenna_offset": "a network fitted to these voyages takes it in",
        "wind_direction_offset": "a network fitted to these voyages takes it in",
        "fouling": "a model fitted to these voyages absorbs it",
    }
    assert {k: v for k, v in afloat.untested.items() if k in why} == why
    tested = {c.label for c in afloat.trial.reference.model.causes}
    assert {"current", "rudder_delay", "thrust_drift", "yaw_rate_bias", "bank"} <= tested
    assert not tested & set(afloat.untested)


def test_its_misfit_and_no_coefficients_stand_beside_every_hypothesis(afloat):
    """The level's last numbers are the misfit's, and what they push is what is taken off."""
    trial, ref = afloat.trial, afloat.trial.reference
    assert ref.learned and ref.columns.base == 0
    count = ref.columns.linearised
    assert ref.misfit.count == ref.columns.misfit == len(ref.columns.unit) - count > 0
    base, _ = trial.scan(afloat.point, ())
    d = trial.solved(afloat.point, base)
    left, own = trial.left(afloat.point.linear, d)
    weights = d[count:]
    pushed = ref.misfit.pushed(afloat.point.linear.cut, trial.grid) @ weights
    wanted = afloat.point.linear.e - np.einsum(
        "sbcz,sz->sbc", afloat.point.linear.z[..., 6:], pushed
    )
    assert left.e == pytest.approx(wanted) and own == pytest.approx(d[:count])
    assert np.abs(pushed).max() > 0.0
    assert trial.coefficients(afloat.point, base) == pytest.approx(ref.misfit.bends(weights))


def test_a_bent_network_is_kept_as_it_was_fitted_again(afloat):
    """Extended, saved, loaded: the same rollouts; diagnosed again it is what is bent further."""
    trial = afloat.trial
    cut = windows_of(afloat.run, afloat.store, afloat.names, afloat.run.profile)
    before = afloat.run.extended(afloat.run.config.seeds[0], afloat.recorded)
    held = HeldOut(cut, before, trial)
    decision = diagnose.decide(trial, afloat.point)
    alone = replace(
        decision, named=(), point=decision.first, base=decision.nothing, apart={}, adapted=True
    )
    after = held.extended(alone)
    assert np.abs(after.model.base.bent).max() > 0.0
    assert not np.allclose(after.losses(cut), before.losses(cut), rtol=1e-3)
    kept = runs.extend(afloat.run, afloat.work / "extended", after)
    again = runs.load(kept.path).extended(afloat.run.config.seeds[0], afloat.recorded)
    assert again.losses(cut) == pytest.approx(after.losses(cut), rel=1e-9)
    bent = again.model.base.bent
    assert kept.base()[0].bent == pytest.approx(bent)
    further = again.with_causes((), {}, None, coefficients=np.full_like(bent, 1e-3))
    assert further.model.base.bent == pytest.approx(bent + 1e-3)


def test_a_network_that_an_earlier_program_bent_is_told_of(afloat):
    plain = afloat.run.extended(afloat.run.config.seeds[0], afloat.recorded)
    kept = runs.extend(afloat.run, afloat.work / "earlier", plain)
    assert kept.extension is not None
    file = kept.path / "extension.safetensors"
    arrays = dict(load_file(file))
    save_file(arrays | {"coefficients": np.ones(72)}, file)
    with pytest.raises(RunError, match="earlier shiplog"):
        _ = kept.extension
    save_file(arrays | {"coefficients": np.zeros(72)}, file)
    assert kept.base()[0].bent is None
