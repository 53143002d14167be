"""One set of causes with raised noise, with an intermittent force, and with a family."""

import math
from dataclasses import replace

import numpy as np
import pytest
import straight
from searchable import Noise, raised_noise, search_of, trial_with

from shiplog.diagnosis.hypotheses import evidence, weighing
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED, Remainder


def test_an_intermittent_force_is_tested_with_no_family(monkeypatch):
    """Where the process noise is raised, whatever was tried before it."""
    asked, real = [], evidence.family_change

    def no_force(fit):
        asked.append(fit.remainder)
        return straight.no_hull(fit)

    more = raised_noise()
    for gain, last in ((0.0, None), (1e4, "time")):  # no family is near, or the last of them is
        asked.clear()
        trial, point = trial_with({}, accelerations=more)
        monkeypatch.setattr(
            evidence, "family_change", lambda *given, gain=gain, last=last: (
                (gain, 3.0) if given[4] == last else real(*given)
            )
        )  # fmt: skip
        search = search_of(trial, point, estimate=no_force)
        search.weigh((), {}, point)
        table = search.table
        assert table.found[(), RAISED].estimate.noise_factor > 1.5
        assert asked[0].kind == RAISED
        assert ((), INTERMITTENT) not in table.found  # it gains nothing: it is raised noise


def pushed_at_one_place(unit):
    """A trial with an intermittent force of 2 N, rms, whose acceleration of 1 N is `unit`."""
    plain, _ = trial_with({})
    alone = replace(
        straight.PROCESS_NOISE, acceleration=1e-6 * straight.PROCESS_NOISE.acceleration,
        intermittent=2.0 * unit,
    )  # fmt: skip
    kernel = np.linalg.cholesky(alone.kernel(plain.grid.nodes))
    drawn = np.random.default_rng(6).standard_normal((8, len(kernel)))
    return trial_with({}, accelerations=drawn @ kernel.T)


@pytest.mark.parametrize(("left", "asked"), [(math.inf, 4), (300.0, 1)])
def test_force_and_numbers_are_fitted_in_turn_until_the_evidence_stays(monkeypatch, left, asked):
    """Estimates that come nearer at each round: three rounds gain, the fourth gains nothing. After
    the first one the noise alone is far more probable, which ends it unless that is allowed."""
    unit = np.array([0.0, 0.3, 0.2])
    trial, point = pushed_at_one_place(unit)
    estimates = iter([0.2, 0.8, 2.0, 2.0, 0.02])
    given = []

    def nearer(fit):
        given.append(next(estimates))
        return SideForce(0.0, 40.0, 0.0, given[-1], unit)

    monkeypatch.setattr(weighing, "LEFT_NATS", left)
    search = search_of(trial, point, estimate=nearer)
    search.weigh((), {}, point)
    table = search.table
    assert len(given) == asked
    if asked > 1:
        assert table.found[(), INTERMITTENT].side_force.force == 2.0
    else:
        assert ((), INTERMITTENT) not in table.found


@pytest.mark.parametrize(("gain", "kept"), [(30.0, True), (-1.0, False)])
def test_a_set_with_the_force_of_another_one_needs_a_gain_of_its_own(gain, kept):
    """The force of nothing is more probable than what is estimated next to the drag; it counts
    there only where an estimate next to the drag gains over raised noise."""
    unit = np.array([0.0, 0.3, 0.2])
    trial, point = pushed_at_one_place(unit)
    search = search_of(trial, point, estimate=lambda fit: SideForce(0.0, 40.0, 0.0, 2.0, unit))
    search.weigh((), {}, point)
    search.noise = Noise(trial, estimate=lambda fit: SideForce(0.0, gain, 0.0, 0.02, unit))
    search.weigh(("drag",), {"drag": np.zeros(1)}, point)
    table = search.table
    assert ((("drag",), INTERMITTENT) in table.found) == kept
    if kept:
        force = table.found[("drag",), INTERMITTENT].side_force
        assert (force.force, force.gain) == (2.0, gain)


@pytest.mark.parametrize("gain", [40.0, -1.0])
def test_an_intermittent_force_is_a_hypothesis_where_it_gains_more_than_raised_noise(gain):
    """Its evidence is that of the trial with the force in the process noise."""
    unit = np.array([0.0, 0.3, 0.2])
    trial, point = pushed_at_one_place(unit)
    search = search_of(
        trial, point, estimate=lambda fit: SideForce(0.0, gain, 0.0, 2.0, unit),
        pattern=lambda force: replace(force, device=0.5),
    )  # fmt: skip
    search.weigh((), {}, point)
    table = search.table
    if gain < 0.0:
        assert ((), INTERMITTENT) not in table.found
        return
    one, raised = table.found[(), INTERMITTENT], table.found[(), RAISED]
    assert one.remainder.intermittent == pytest.approx(2.0 * unit)
    assert one.side_force.device == 0.5
    again = evidence.level(trial, point, one.estimate.noise_factor, (), one.remainder)
    assert one.evidence == pytest.approx(again.value)
    assert one.evidence > raised.evidence + 5.0


def test_a_family_that_explains_a_tenth_of_raised_noise_gains_so_many_nats():
    """N values of variance λ²: their log likelihood over ln λ is that of a Gaussian, and a tenth
    of the raised part less variance is worth that share of N/2 nats."""
    count, factor = 2000.0, 3.0
    levels = [
        evidence.Level(noise, np.eye(1), np.eye(1), np.zeros(1),
                       -count * math.log(noise) - 0.5 * count * (factor / noise) ** 2)
        for noise in (factor / 1.08, factor, factor * (1.0 + 1e-12), factor * 1.08, 1.0)
    ]  # fmt: skip
    rough = weighing.Rough(None, None, weighing.RAISING, levels)
    assert rough.observations == pytest.approx(count, rel=0.02)
    share = 0.1 * (1.0 - 1.0 / factor**2)
    assert rough.spectrum() == pytest.approx(-0.5 * count * math.log(1.0 - share), rel=0.02)
    nominal = weighing.Rough(None, None, weighing.RAISING, [replace(levels[0], noise_factor=1.0)])
    assert nominal.spectrum() == 0.0


@pytest.mark.parametrize(("gain", "noisy"), [(2.0, False), (200.0, True)])
def test_with_raised_noise_a_family_counts_where_it_alone_is_likelier_than_the_noise(
    gain, noisy, monkeypatch
):
    """What gains a little together with noise that explains much is fitted to that noise."""
    trial, point = trial_with({}, accelerations=raised_noise())
    trial = replace(trial, campaign=replace(trial.campaign, noise=0.05))  # parts of the same noise
    monkeypatch.setattr(evidence, "family_change", lambda *given: (gain, 3.0))
    levels = weighing.nominal_levels(trial, point, (), 1.0)
    raised = max(level.value for level in levels)
    quiet = weighing.best(trial, levels, NOMINAL).value
    logs = np.log([level.noise_factor for level in levels])
    values = np.array([level.value for level in levels])
    values += -0.5 * (logs / 0.05) ** 2 + 0.5 * logs**2 + math.log(1.0 / 0.05)
    near = np.argsort(np.abs(logs - logs[values.argmax()]))[:3]
    a, b, c = np.polyfit(logs[near], values[near], 2)
    assert quiet == pytest.approx(c - b**2 / (4.0 * a), abs=0.05)
    assert quiet + 2.0 < raised < quiet + 200.0
    of = search_of(trial, point).cause_set(())
    either = weighing.Rough(of, point, weighing.RAISING, levels)
    change = weighing.change(either, either, "time")
    assert change.remainder == Remainder("time", 3.0, noisy)
    assert change.value == (pytest.approx(either.best.value + gain) if noisy else -math.inf)


@pytest.mark.parametrize("acts", [True, False])
def test_what_explains_half_a_tenth_of_raised_noise_is_an_error_of_its_spectrum(acts, monkeypatch):
    """The family alone is likelier than the noise, as parts differ by as much as the trial does."""
    trial, point = trial_with({}, accelerations=raised_noise())
    trial = replace(trial, campaign=replace(trial.campaign, noise=1.0))
    of = replace(search_of(trial, point).cause_set(()), spectrum=acts)
    levels = weighing.nominal_levels(trial, point, (), 1.0)
    either = weighing.Rough(of, point, weighing.RAISING, levels)
    gain = 0.5 * either.spectrum()
    assert gain > 2.0
    monkeypatch.setattr(evidence, "family_change", lambda *given: (gain, 3.0))
    change = weighing.change(either, either, "time")
    assert change.remainder == Remainder("time", 3.0, True)
    assert change.value == (-math.inf if acts else pytest.approx(either.best.value + gain))
