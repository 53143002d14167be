"""A network that was trained on the very voyages that are diagnosed, the whole way."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.experiments.simulated_ship import cases, sensors
from shiplog.commands.diagnose import diagnose_run
from shiplog.commands.prepare import ingest_logs
from shiplog.commands.train_networks import train_run
from shiplog.diagnosis.hypotheses import evidence, fits
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.trial import setup
from shiplog.diagnosis.trial import trial_voyages as trials
from shiplog.diagnosis.trial.fitted import Fit
from shiplog.diagnosis.trial.setup import trial_of
from shiplog.diagnosis.trial.trial_voyages import record_of, rescale_time
from shiplog.diagnosis.verdict import network_base
from shiplog.diagnosis.verdict.held_out import HeldOut
from shiplog.report.diagnosis.verdict_sentence import less
from shiplog.training.runs import extension_file, load_model
from shiplog.training.settings.run_config import Config, Fast, NetworkSettings
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split_settings import Split

pytestmark = [pytest.mark.nightly, pytest.mark.usefixtures("trained_here")]
SEED = 7101


@pytest.fixture(scope="module")
def afloat(tmp_path_factory):
    """Voyages in a current, and a small network of them that is trained for seconds."""
    work = tmp_path_factory.mktemp("network")
    (work / "logs").mkdir()
    case = cases.draw(SEED, cause="current", size=1.0, seconds=3000)
    paths = []
    for leg in case.trial:
        paths.append(work / "logs" / f"{leg.name}.mcap")
        sensors.write_voyage(paths[-1], cases.voyage(case, leg), seed=leg.seed, start=leg.start)
    store = Store(work / "store")
    assert not ingest_logs(paths, "esso-vectwin", store).refused
    names = [leg.name for leg in case.trial]
    config = Config(
        recipe="fast", fast=Fast(warm_epochs=12, iterations=10), window=100,
        network=NetworkSettings(width=24, depth=2, wind_input="components"),
        split=Split(training=tuple(names[1:]), validation=tuple(names[:1])),
    )  # fmt: skip
    run = train_run(config, store, work / "run")
    _, recorded = rescale_time(run, None, record_of(store, names, run.profile))
    made = []

    def kept(*given, **named):
        made.append(trial_of(*given, **named))
        return made[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(setup, "trial_of", kept)
        done = diagnose_run(run.path, store, names, work / "out")
    return SimpleNamespace(
        work=work, run=run, names=names, case=case, recorded=recorded, done=done,
        trial=done.trial, untested=made[0].untested, point=done.decision.nothing.point,
        decision=replace(done.decision, adapted=False), network=done.held.own, held=done.held,
    )  # fmt: skip


def test_what_only_renames_its_inputs_is_not_testable_with_a_network(afloat):
    """Nor what any fit absorbs; what it cannot see is."""
    why = {
        "rudder_offset": "a network fitted to these voyages absorbs it",
        "antenna_offset": "a network fitted to these voyages absorbs it",
        "wind_direction_offset": "a network fitted to these voyages absorbs it",
        "fouling": "a model fitted to these voyages absorbs it",
    }
    assert {k: v for k, v in afloat.untested.items() if k in why} == why
    tested = {c.label for c in afloat.trial.reference.model.causes}
    assert {"current", "rudder_delay", "thrust_drift", "yaw_rate_bias", "bank"} <= tested
    assert not tested & set(afloat.untested)


def test_the_whole_current_is_found_though_the_network_learned_in_it(afloat):
    """By the ship's MMG, fitted to the same voyages: it has no heading in its forces."""
    (one,) = afloat.decision.named
    (hidden,) = afloat.case.causes
    assert one.cause.label == hidden.name == "current"
    for name, truth in hidden.parameters.items():
        displayed = one.estimates[name]
        assert displayed.low <= truth["value"] <= displayed.high


def test_a_function_of_the_networks_inputs_is_in_every_hypothesis(afloat):
    """The level's last numbers are its, and their accelerations are what is taken off."""
    trial, ref = afloat.trial, afloat.trial.reference
    assert ref.columns.base == len(ref.theta) > 0
    count = ref.columns.linearised
    assert ref.misfit.count == ref.columns.misfit == len(ref.columns.unit) - count > 0
    base, _ = evidence.scan(trial, afloat.point, ())
    fit = Fit(afloat.point, base, Remainder())
    d = fits.numbers_from_point(trial, fit)
    left, own_numbers = trial.less_misfit(afloat.point.linear, d)
    weights = d[count:]
    accelerations = ref.misfit.accelerations(afloat.point.linear.cut, trial.grid) @ weights
    wanted = afloat.point.linear.e - np.einsum(
        "sbcz,sz->sbc", afloat.point.linear.z[..., 6:], accelerations
    )
    assert left.e == pytest.approx(wanted) and own_numbers == pytest.approx(d[:count])
    assert np.abs(accelerations).max() > 0.0
    moved = fits.coefficients(trial, fit)
    assert moved == pytest.approx(ref.theta + d[: ref.columns.base])


def test_what_is_named_stands_in_the_network_with_the_judges_numbers(afloat):
    """And stays: fitted again with it are the network's bends, on the judge's segments."""
    trial, extended = afloat.network.extended_by(afloat.decision)
    assert extended.named == afloat.decision.named
    (one,) = extended.named
    assert extended.fit.point.numbers["current"] == pytest.approx(one.numbers)
    assert extended.fit.estimate.numbers["current"] == pytest.approx(one.numbers, rel=1e-4)
    assert extended.nothing.point.numbers == {} and extended.nothing.included == ()
    ref, base = trial.reference, trial.reference.model.base
    d = fits.solution(trial, extended.fit).mean
    weights = d[ref.columns.linearised : len(ref.columns.unit)]
    assert fits.coefficients(trial, extended.fit) == pytest.approx(ref.misfit.bends(weights))
    assert np.abs(weights).max() > 0.0 and base.bent is None
    assert (trial.rows == afloat.trial.rows).all()
    assert afloat.network.extended_by(afloat.decision)[0] is trial
    less = afloat.trial.leave_out(np.arange(len(trial.rows)) == 3)
    again, _ = network_base.Own(afloat.run, less).extended_by(afloat.decision)
    assert (again.weight == 0.0).nonzero()[0].tolist() == [3]


def test_each_voyage_is_left_out_of_the_bends_and_of_the_numbers(afloat):
    decision = replace(afloat.decision, adapted=True)
    names = afloat.names
    (numbers, bends), (others, bent) = (
        afloat.held.refit(decision, name, None) for name in names[:2]
    )
    whole = afloat.held.extended(decision).model.base.bent
    assert bends.shape == bent.shape == whole.shape
    for one in (bends, bent):
        assert np.abs(one - whole).max() > 1e-3 * np.abs(whole).max()
    assert np.abs(bends - bent).max() > 1e-3 * np.abs(whole).max()
    assert not np.allclose(numbers["current"], others["current"], rtol=1e-6)
    out = decision.fit.point.linear.cut.voyage == 0
    alone, _ = fits.refitted(afloat.trial, decision.fit, out)
    assert numbers["current"] == pytest.approx(alone["current"])


def test_what_refutes_a_cause_of_a_network_is_its_mmg(afloat):
    """It simulates as it was fitted, with what the run has of causes; of a physical run that is
    the run."""
    judge = trials.simulator(afloat.run, afloat.trial)
    ref = afloat.trial.reference
    assert judge.theta == pytest.approx(ref.theta) and judge.model.causes == ()
    assert type(judge.model.base).__name__ == "MMG"
    extended = load_model.load(
        extension_file.extend(
            afloat.run, afloat.work / "current", afloat.held.extended(afloat.decision)
        )
    )
    trial = trial_of(extended, None, afloat.recorded, ()).trial
    again = trials.simulator(extended, trial)
    assert [c.label for c in again.model.causes] == ["current"]
    numbers = afloat.decision.named[0].numbers
    assert again.theta[-len(numbers) :] == pytest.approx(numbers)
    assert again.shares.keys() == set(afloat.names)


def test_the_network_is_fitted_again_where_that_makes_its_error_less(afloat):
    """Whatever the judge did; and with nothing named there is nothing to gain."""
    plain, adapted = (replace(afloat.decision, adapted=a) for a in (False, True))
    losses = [afloat.held.gain(one).after for one in (plain, adapted)]
    for given in (plain, adapted):
        decision, found = afloat.held.simulated_with(given)
        assert found.after == pytest.approx(min(losses))
        assert decision.adapted == (losses[1] < losses[0])
    nothing, none = afloat.held.simulated_with(replace(adapted, named=()))
    assert none is None and not nothing.adapted


def test_a_networks_verdict_is_of_the_mmg_and_its_gain_of_the_network(afloat):
    done = afloat.done
    judge = HeldOut(afloat.held.cut, trials.simulator(afloat.run, done.trial), done.trial)
    found = judge.gain(replace(done.decision, adapted=False))
    assert done.verdict.gain.before == pytest.approx(afloat.held.losses_before.sum(1).mean())
    assert [c.name for c in done.verdict.causes] == ["current"]
    output = [n for n in done.verdict.notes if "MMG" in n]
    assert "run is a network" in output[0] and less(found.reduction) in output[1]
    trial, decision = done.simulated
    assert trial.reference.model.base.weights and done.whole.j.shape[-1] == 2  # the current's
    assert done.trial.reference.model.base is not trial.reference.model.base
    assert (done.folder / "diagnosis.rrd").is_file() and decision.named


def test_a_bent_network_is_kept_as_it_was_fitted_again(afloat):
    """Extended, saved, loaded: the same rollouts; diagnosed again it is what is bent further."""
    held, cut, before = afloat.held, afloat.held.cut, afloat.held.before
    decision = afloat.decision
    alone = replace(decision.unnamed, adapted=True)
    after = held.extended(alone)
    assert np.abs(after.model.base.bent).max() > 0.0
    assert not np.allclose(after.losses(cut), before.losses(cut), rtol=1e-3)
    kept = load_model.load(extension_file.extend(afloat.run, afloat.work / "extended", after))
    again = kept.extended(afloat.run.config.seeds[0], afloat.recorded)
    assert again.losses(cut) == pytest.approx(after.losses(cut), rel=1e-9)
    bent = again.model.base.bent
    assert kept.base()[0].bent == pytest.approx(bent)
    further = again.with_causes((), {}, None, coefficients=np.full_like(bent, 1e-3))
    assert further.model.base.bent == pytest.approx(bent + 1e-3)
