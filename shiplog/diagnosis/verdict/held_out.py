"""The gain of causes on held-out windows: numbers fitted without the windows' voyage.

    L_w = Σ_channels L_wc of each window w,   gain = 1 - Σ_w L_w(after)/Σ_w L_w(before)

with `after` rolled out by numbers that were fitted without the voyage of w, or without its half of
the only voyage.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.stats import mannwhitneyu

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import fits
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict import sign_conventions
from shiplog.diagnosis.verdict.network_base import Own
from shiplog.diagnosis.verdict.result import Decision, Named
from shiplog.models.causes import constants_of
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.error_reduction import Gain, diverged, gain, parts
from shiplog.simulation.extended_simulator import ExtendedSimulator
from shiplog.voyages.windows.windows import Windows

Half = tuple[float, bool] | None  # s into the voyage, and whether it is the later half
ONE_SIDE = 0.05  # probability, of one side of a 90 % interval
ROUNDING = 1e-6  # of L: two rollouts that differ by no more are the same


@dataclass(frozen=True)
class Rollouts:
    """A trial's windows, and the model as it stands."""

    cut: Windows
    before: ExtendedSimulator

    @cached_property
    def voyages(self) -> list[str]:
        """Of each window."""
        return self.cut.plan["voyage"].to_list()

    @cached_property
    def states_before(self) -> np.ndarray:
        return self.before.states(self.cut, self.before.theta)

    def parts(self, states: np.ndarray) -> np.ndarray:
        """L of each window by channel [N, 3]."""
        return parts(states - self.cut.state, self.cut.dt)

    @cached_property
    def losses_before(self) -> np.ndarray:
        """[N, 3] by channel."""
        return self.parts(self.states_before)

    @cached_property
    def counted(self) -> np.ndarray:
        """[N] bool: the windows of every figure, in which the model as it stands does not diverge.

        One window in which the model diverges says nothing of a cause, and would outweigh all
        others. A model that diverges in half of them or more does not simulate this ship: all are
        counted.
        """
        counted = ~diverged(self.losses_before)
        return counted if 2 * counted.sum() > len(counted) else np.ones_like(counted)

    @property
    def not_counted(self) -> int:
        """Windows that are in no figure."""
        return int((~self.counted).sum())

    def gain_between(self, before: np.ndarray, after: np.ndarray) -> Gain:
        """Of L by window and channel [N, 3], on the windows that are counted."""
        counted = self.counted
        voyages = [name for name, kept in zip(self.voyages, counted, strict=True) if kept]
        return gain(before[counted], after[counted], voyages)


@dataclass(frozen=True)
class HeldOut(Rollouts):
    """Windows and model, with the trial whose causes are judged on them. `own` is a network whose
    causes were found on another model; `nominal` are the windows of the nominal voyages; `read_as`
    is the profile through which the trial was read."""

    trial: Trial
    own: Own | None = None
    nominal: Windows | None = None
    read_as: Profile | None = None

    def states_after(self, decision: Decision, absent: str = "") -> np.ndarray:
        """[N, I, 6] by the extended model, with numbers fitted without each window's voyage;
        those of a cause that is `absent` are zero."""
        states = np.empty(self.cut.state.shape)
        needed = self._constants(decision)
        for voyage, half, rows in self.folds():
            numbers, coefficients = self.refit(decision, voyage, half)
            if absent:
                numbers = numbers | {absent: np.zeros_like(numbers[absent])}
            simulator = self.before.with_causes(
                [n.cause for n in decision.named], numbers, None, needed, coefficients
            )
            states[rows] = simulator.states(self.cut.pick(rows), simulator.theta)
        return states

    def gain(self, decision: Decision) -> Gain:
        """1 - Σ L_after/Σ L_before of what is named over nothing, with its interval."""
        return self.gain_between(self.losses_before, self.parts(self.states_after(decision)))

    def share_of_excess(self, gain: Gain) -> float:
        """(L_before - L_after)/(L_before - L_nominal), with the mean L of the nominal windows; of
        all of L where there are none, or where these are no worse."""
        level = self._level or 0.0
        excess = gain.before - level if level < gain.before else gain.before
        return (gain.before - gain.after) / max(excess, 1e-12)

    def changes_velocity(self, decision: Decision, one: Named) -> bool:
        """Whether a named cause itself changes the velocities that the windows compare. The clock
        of the position does not; numbers that are fitted together with it may."""
        present = self.parts(self.states_after(decision))
        return not np.allclose(
            self.parts(self.states_after(decision, one.cause.label)), present, rtol=ROUNDING
        )

    def adapted(self, decision: Decision) -> Gain:
        """Gain of fitting the model's own coefficients again, with no cause named."""
        return self.gain(decision.unnamed)

    def extended(self, decision: Decision) -> ExtendedSimulator:
        """The model with the named causes, their numbers fitted to all voyages."""
        named, coefficients = decision.named, None
        if decision.adapted:
            trial, simulated = self.simulated(decision)
            coefficients = fits.coefficients(trial, simulated.fit)
        return self.before.with_causes(
            [n.cause for n in named], {n.cause.label: n.numbers for n in named},
            {n.cause.label: n.covariance for n in named}, self._constants(decision),
            coefficients,
        )  # fmt: skip

    def simulated(self, decision: Decision) -> tuple[Trial, Decision]:
        """The model that is simulated on the trial's segments, with the named causes."""
        return (self.trial, decision) if self.own is None else self.own.extended_by(decision)

    def better(self, decision: Decision, found: Gain) -> tuple[Decision, Gain]:
        """The same with the model's own coefficients fitted again together with what is named,
        where that makes the error less."""
        adapted = replace(decision, adapted=True)
        again = self.gain(adapted)
        return (adapted, again) if again.after < found.after else (decision, found)

    def simulated_with(self, decision: Decision) -> tuple[Decision, Gain | None]:
        """Decision and gain with the causes that another model named, in this one."""
        plain = replace(decision, adapted=False)
        if not decision.named:
            return plain, None
        found = self.gain(plain)
        return self.better(plain, found) if self.trial.reference.adapts else (plain, found)

    def worth(self, rest: Decision, decision: Decision) -> Gain:
        """Gain of a decision over the same decision without one cause."""
        return self.gain_between(
            self.parts(self.states_after(rest)), self.parts(self.states_after(decision))
        )

    def lost(self, found: Gain | None, named: Collection[str] = ()) -> str:
        """Why no cause can be named; empty where one can.

        Either another convention explains the error better than all named causes do, and is none of
        them, or the model is worse than holding the velocity, with the named causes in it too.
        """
        counted = self.cut.pick(np.flatnonzero(self.counted))
        own = float(self.losses_before[self.counted].sum(1).mean())
        after = own if found is None else min(own, found.after)
        hold = float(parts(counted.state[:, :1] - counted.state, counted.dt).sum(1).mean())
        other = self._other
        explains = sign_conventions.explains(other, own, after, hold, self._level)
        if explains and other.cause not in named:
            return sign_conventions.sentence(other, own)
        if own <= thresholds.WORSE_THAN_HOLDING * hold or after <= hold:
            return ""
        return (
            f"The model is worse than one that keeps its velocities (L {own:.0f}, that one "
            f"{hold:.0f})"
        )

    @property
    def hint(self) -> str:
        """What a convention takes away of the trial's excess where it does not explain the trial:
        a note on a verdict that is open. Empty where it takes away less than half."""
        own, level = float(self.losses_before[self.counted].sum(1).mean()), self._level
        other = self._other
        if level is None or own <= level or (other.there or 0.0) < 1.0:
            return ""
        if other.loss > level + thresholds.MOST * (own - level):
            return ""
        return (
            f"{sign_conventions.sentence(self._other, own)}: these data hardly determine which is "
            "right."
        )

    @property
    def worse_than_nominal(self) -> bool:
        """Whether the windows' errors are greater than those of the nominal windows, by the rank
        sums of L (Mann & Whitney 1947); so, too, without nominal windows. One window with most of
        the error decides nothing there."""
        if self.nominal is None:
            return True
        nominal = self.parts_of(self.nominal)
        trial = self.losses_before[self.counted]
        p = mannwhitneyu(trial.sum(1), nominal.sum(1), alternative="greater").pvalue
        return bool(p < ONE_SIDE)

    def parts_of(self, cut: Windows) -> np.ndarray:
        """L by channel [N, 3] of other windows, by the model as it stands."""
        return parts(self.before.states(cut, self.before.theta) - cut.state, cut.dt)

    @cached_property
    def _other(self) -> sign_conventions.Tried:
        counted = self.cut.pick(np.flatnonzero(self.counted))
        return sign_conventions.try_conventions(self.before, counted, self.nominal, self.read_as)

    @cached_property
    def _level(self) -> float | None:
        """Mean L of the nominal windows that the model simulates; None without any."""
        if self.nominal is None:
            return None
        return sign_conventions.mean(
            self.before, sign_conventions.simulated(self.before, self.nominal)
        )

    def _constants(self, decision: Decision) -> dict[str, np.ndarray]:
        return constants_of((n.cause for n in decision.named), self.trial.reference.setting)

    @property
    def left_out(self) -> str:
        """The part of the data without which each window's numbers were fitted."""
        return "its half of the voyage" if self._halved else "its voyage"

    @property
    def _halved(self) -> bool:
        """Whether halves of voyages are left out: of one alone."""
        return len(set(self.voyages)) == 1

    def folds(self) -> Iterator[tuple[str, Half, np.ndarray]]:
        """(voyage, half of it, window rows) that are left out: whole voyages, or halves of one."""
        elapsed = self.cut.plan["elapsed"].to_numpy()
        for name in dict.fromkeys(self.voyages):
            own = np.array([n == name for n in self.voyages])
            if not self._halved:
                yield name, None, np.flatnonzero(own)
                continue
            first, last = elapsed[own].min(), elapsed[own].max()
            middle = 0.5 * (first + last + float(self.cut.dt[0].sum()))
            for late in (False, True):
                rows = np.flatnonzero(own & ((elapsed >= middle) == late))
                if len(rows):
                    yield name, (middle, late), rows

    def refit(
        self, decision: Decision, voyage: str, half: Half
    ) -> tuple[dict[str, np.ndarray], np.ndarray | None]:
        """Numbers of the named causes, fitted without a part of the data; and the coefficients
        together with them where the model adapts."""
        recorded, segment = self.trial.record, decision.fit.point.linear.cut
        index = recorded.names.index(voyage) if voyage in recorded.names else -1
        out = segment.voyage == index
        if half is not None:
            middle, late = half
            out &= (recorded.time[segment.rows] >= middle) == late
        numbers, coefficients = {}, None
        if decision.fit.included or decision.adapted:
            numbers, fitted = fits.refitted(self.trial, decision.fit, out)
            if self.own is not None and decision.adapted:
                trial, simulated = self.own.extended_by(decision)
                _, fitted = fits.refitted(trial, simulated.fit, out)
            coefficients = fitted if decision.adapted else None
        return {n.cause.label: numbers[n.cause.label] for n in decision.named}, coefficients
