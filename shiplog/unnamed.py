"""What has no name of its own, on the same scale of evidence: structures that anything may have,
and a force that nobody records.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from shiplog import evidence, reference, structure
from shiplog.columns import HELD
from shiplog.evidence import Unrest
from shiplog.hypotheses import LOUDER, Found, Point, Trial
from shiplog.linearise import Linear
from shiplog.models.mmg import MMG, body
from shiplog.reference import Reference
from shiplog.structure import Basis, Products
from shiplog.traced import traced

REACH = 0.5  # lengths from midship
LOUD = 1.2  # from which on a structure may also bring the usual unrest back


@dataclass(frozen=True)
class Pulses:
    """The unrecorded thruster: log likelihood, its gain over process noise that is raised in each
    channel by itself, place [m ahead of midship], root mean square force [N], and acceleration of
    1 N [3]."""

    value: float
    gain: float
    lever: float
    force: float
    unit: np.ndarray


@dataclass(frozen=True)
class Family:
    """One kind of structure, and what the nominal campaign has of it.

    before  [1 + C + W, 1 + C + W]  products of that campaign's [e | J | W]; None where it says
            nothing of the structure
    """

    name: str
    basis: Basis | Products
    before: np.ndarray | None


class Structures:
    """All families, about a trial's first point: what they depend on was measured.

    Of a network that has learned of what is wrong only those that it cannot see: what is left of
    its own inputs is a poor fit, and another training might take it in.
    """

    def __init__(self, trial: Trial, point: Point) -> None:
        self.trial = trial
        ref = trial.reference
        here, usual = structure.at_knots(point.linear.cut, trial.grid), None
        if ref.nominal is not None:
            usual = structure.at_knots(ref.nominal.cut, trial.grid)
        both = [k for k in (usual, here) if k]
        bases: list[tuple[str, Basis | Products | None]] = [
            (name, structure.basis(name, trial.record, *both))
            for name in (structure.UNSEEN if ref.learned else structure.FAMILIES)
        ]
        if not ref.learned:
            bases.append(("controls", structure.products(trial.record, *both)))
        self.families: list[Family] = []
        for name, basis in bases:
            if basis is None:
                continue
            before = None
            if usual is not None and ref.modes is not None and name != "time":
                pushed = structure.pushed(basis.features(usual), ref.unrest.push)
                before = ref.modes.beside(pushed).total(np.ones(len(pushed)))
            self.families.append(Family(name, basis, before))

    def found(self, point: Point, base: Found, included: Sequence[str]) -> list[Found]:
        """Each family's evidence above the base hypothesis, less what is usual of it."""
        found: dict[str, Found] = {}
        for family in self.families:
            tried = []
            for louder in {base.louder, 1.0 if base.louder > LOUD else base.louder}:
                _, total = self._beside(family, point, louder)
                tried += _structure(
                    self.trial, family.name, total, family.before, point, included, louder
                )
            best = max(tried, key=lambda f: f.evidence)
            best = replace(best, evidence=best.evidence - base.evidence)
            if family.name not in found or best.evidence > found[family.name].evidence:
                found[family.name] = best
        return sorted(found.values(), key=lambda f: -f.evidence)

    def acts_on(self, point: Point, found: Found) -> tuple[str, ...]:
        """Channels in which a structure pushes by more than a third of where it pushes most."""
        family = next(f for f in self.families if f.name == found.name)
        features, total = self._beside(family, point, 1.0)
        total = total[-features.shape[-1] :]
        own = total[:, -len(total) :]
        weights = np.linalg.solve(own + np.eye(len(own)) / structure.SIZES[1] ** 2, total[:, 0])
        pushed = (features @ weights).std((0, 1))
        names = np.array(["surge", "sway", "yaw_rate"])
        return tuple(str(n) for n in names[pushed > pushed.max() / 3.0])

    def _beside(self, family: Family, point: Point, louder: float) -> tuple[np.ndarray, np.ndarray]:
        """The family's features at the point, and the trial's products with them."""
        trial = self.trial
        features = family.basis.features(structure.at_knots(point.linear.cut, trial.grid))
        pushed = structure.pushed(features, trial.reference.unrest.push)
        modes, louder = trial.modes(point, louder)
        return features, modes.beside(pushed).total(trial.weight, louder)


def _structure(trial: Trial, family, whole, before, point, included, louder) -> Iterator[Found]:
    """At one λ, in each size."""
    ref = trial.reference
    unit = ref.columns.unit
    count, more = len(unit), len(whole) - 1 - len(unit)
    volume = trial.volume(louder)
    for size in structure.SIZES:
        by = np.concatenate(([1.0], unit, np.full(more, size)))
        total = whole * np.outer(by, by)
        known, pull = _usual(trial, before, by, more)
        value = trial.solve(
            _twice(total, more), volume, louder, point, included,
            _beside(known, more), np.concatenate((pull, np.zeros(more))),
        ).value  # fmt: skip
        if before is not None:
            # what the nominal campaign has of it already is no news
            usual = trial.solve(total, volume, louder, point, included, known, pull)
            kept = total[: count + 1, : count + 1]
            without = trial.solve(kept, volume, louder, point, included, ref.information, ref.pull)
            value -= max(usual.value - without.value, 0.0)
        yield Found(family, value, louder)


def _usual(trial: Trial, before, by, more) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients and a structure's weights after the nominal campaign; where that says
    nothing of the structure, it is usually not there."""
    ref = trial.reference
    if before is None:
        held = _beside(ref.information, more)
        held[len(ref.pull) :, len(ref.pull) :] *= HELD
        return held, np.concatenate((ref.pull, np.zeros(more)))
    ones, zeros = np.ones(more), np.zeros(more)
    return reference.usual(
        before * np.outer(by, by), ref.kappa,
        np.concatenate((ref.columns.known, ones)), np.concatenate((ref.anchor, zeros)),
    )  # fmt: skip


def pulses(trial: Trial, point: Point, base: Found, usual: np.ndarray | None = None) -> Pulses:
    """A force to the side that comes and goes at one place along the ship, unrecorded: its
    accelerations go together as those of no other unrest do. Judged on what is left.

    usual    acceleration [3] that the nominal process noise has at one place; none where None
    """
    left, d = trial.left(point.linear, trial.solved(point, base))
    return pulses_of(left, d, trial.reference, trial.unrest, trial.weight, usual)


def pulses_of(
    linear: Linear, d: np.ndarray, ref: Reference, unrest: Unrest, weight: np.ndarray,
    usual: np.ndarray | None = None,
) -> Pulses:  # fmt: skip
    """The same of a pass whose numbers are d [C], its segments of a `weight` [S]."""
    kept = weight > 0.0  # a segment that says nothing has no likelihood
    linear, weight = linear.pick(kept), weight[kept]
    # subtracted before it is squared: of products small differences of large numbers would be left
    alone = replace(linear, e=linear.e - linear.j @ d, j=linear.j[..., :0])
    startless = evidence.startless(evidence.weighed(alone, unrest), unrest)
    plain = replace(unrest, pulse=None)

    def value(unrest: Unrest) -> float:
        each, volume = startless.square(unrest)
        return -0.5 * ref.counts * (float(weight @ each) + volume)

    def raised(factors: np.ndarray) -> float:
        side = math.exp(0.5 * (factors[1] + factors[2]))
        pulse = None if usual is None else usual * side
        return value(replace(plain, push=plain.push * np.exp(factors), pulse=pulse))

    # from day to day one channel's noise is raised by more than another's, with no device at work,
    # and what usually pushes at one place pushes there more
    first = np.full(3, math.log(max(LOUDER, key=lambda v: value(plain.louder(v)))))
    about = {"initial_simplex": first + 0.3 * np.eye(4, 3), "xatol": 0.02, "fatol": 0.1}
    by_channel = -float(minimize(lambda at: -raised(at), first, method="Nelder-Mead",
                                 options=about).fun)  # fmt: skip
    ship, length = ref.model.stand_in, ref.setting.scale["length"]
    across, turning = accelerations(ship, ref.coefficients, np.eye(3)[1:])  # of 1 N, of 1 N m

    def of(lever: float, force: float) -> float:
        unit = across + lever * length * turning
        return value(replace(plain, pulse=unit * force))

    levers = np.linspace(-0.45, 0.45, 7)
    # in newtons that matter: from the usual unrest upwards
    ordinary = plain.push[1] / abs(across[1])
    sizes = ordinary * np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    lever, force = max(itertools.product(levers, sizes), key=lambda tried: of(*tried))
    finer = minimize(  # beside the place itself a part of the force would be another cause's
        lambda at: -of(at[0], math.exp(at[1])), (lever, math.log(force)), method="Nelder-Mead",
        bounds=((-REACH, REACH), (None, None)), options={"xatol": 0.005, "fatol": 0.1},
    )  # fmt: skip
    lever, force = float(finer.x[0]) * length, math.exp(finer.x[1])
    one = -float(finer.fun)
    return Pulses(one, one - by_channel, lever, force, across + lever * turning)


def pulse_force(
    trial: Trial, point: Point, base: Found, pulses: Pulses
) -> tuple[np.ndarray, np.ndarray]:
    """Force of the unrecorded thruster at the knots and its standard deviation [S, J] in N."""
    unrest = trial.unrest.louder(base.louder)
    left = trial.left(point.linear, trial.solved(point, base))
    z, covariance = evidence.starts_and_knots(*left, unrest)
    knots = trial.grid.knots
    kernel = unrest.kernel(knots)
    pulse = replace(unrest, push=1e-9 * unrest.push).kernel(knots)
    share = pulse @ np.linalg.inv(kernel)
    pushed = (z[:, 6:] @ share.T).reshape(len(z), 3, knots)
    sway = slice(knots, 2 * knots)
    beyond = (pulse - share @ pulse)[sway, sway]
    known = share[sway] @ covariance[:, 6:, 6:] @ share[sway].T
    variance = np.diagonal(known + beyond, axis1=1, axis2=2)
    return pushed[:, 1] / pulses.unit[1], np.sqrt(np.maximum(variance, 0.0)) / pulses.unit[1]


def accelerations(ship: MMG, coefficients: Mapping, force: np.ndarray) -> np.ndarray:
    """ν̇ [n, 3] that forces X, Y, N [n, 3] make of a ship at rest."""
    return np.asarray(_accelerations(ship, dict(coefficients), force))


@traced
def _accelerations(ship, coefficients, force):
    zero = jnp.zeros(())
    return body.accelerations(coefficients, ship.geometry, zero, zero, zero, force)


def _twice(total: np.ndarray, more: int) -> np.ndarray:
    """The last columns once more: what is usual of them, and what changed."""
    at = np.arange(len(total))
    both = np.concatenate((at, at[len(at) - more :]))
    return total[np.ix_(both, both)]


def _beside(information: np.ndarray, more: int) -> np.ndarray:
    """With as many numbers more, of unit size each."""
    whole = np.eye(len(information) + more)
    whole[: len(information), : len(information)] = information
    return whole
