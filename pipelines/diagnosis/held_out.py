"""What causes are worth on windows whose voyage had no part in their numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch

from pipelines.diagnosis.own import Own
from shiplog import conventions, diagnose, direct
from shiplog import decision as decisions
from shiplog.causes import constants_of
from shiplog.decision import Decision, Named
from shiplog.extend import ExtendedSimulator
from shiplog.gain import Gain, gain, parts
from shiplog.hypotheses import Trial
from shiplog.sensitivity import series
from shiplog.windows import Windows

WORTH = 0.02  # of the error, that each of several causes must take off held-out windows
LOST = 2.0  # times the L of keeping all velocities, from which on a model simulates nothing
TURNED = 0.5  # of the L with all that was named, below which a sign is the other way round
HARM = 1.2  # times the error, from which on even an instrument's fault is refuted
BESIDE = 2.0  # times the evidence that is beyond doubt, of a cause beside others
VOYAGES = 3  # fewer cannot choose causes by voyages left out

Half = tuple[float, bool] | None  # s into the voyage, and whether it is the later half


@dataclass(frozen=True)
class Rollouts:
    """A trial's windows, and the model as it stands."""

    cut: Windows
    before: ExtendedSimulator

    @cached_property
    def measured(self) -> np.ndarray:
        return self.cut.state.double().numpy()

    @cached_property
    def steps(self) -> np.ndarray:
        return series(self.cut).steps

    @cached_property
    def voyages(self) -> list[str]:
        """Of each window."""
        return self.cut.plan["voyage"].to_list()

    @cached_property
    def states_before(self) -> np.ndarray:
        return self.before.states(self.cut, self.before.theta)

    def parts(self, states: np.ndarray) -> np.ndarray:
        """L of each window by channel [N, 3]."""
        return parts(states - self.measured, self.steps)

    @cached_property
    def losses_before(self) -> np.ndarray:
        """[N, 3] by channel."""
        return self.parts(self.states_before)


@dataclass(frozen=True)
class HeldOut(Rollouts):
    """The same with the trial whose causes are judged on them; `own` of a network, whose causes
    another model found."""

    trial: Trial
    own: Own | None = None

    def states_after(self, decision: Decision) -> np.ndarray:
        """[N, I, 6] by the extended model, with numbers fitted without each window's voyage."""
        states = np.empty(tuple(self.cut.state.shape))
        needed = self._constants(decision)
        for voyage, half, rows in self._folds(self._halved(decision)):
            numbers, coefficients = self._without(decision, voyage, half)
            simulator = self.before.with_causes(
                [n.cause for n in decision.named], numbers, None, needed, coefficients
            )
            states[rows.numpy()] = simulator.states(self.cut.pick(rows), simulator.theta)
        return states

    def gain(self, decision: Decision) -> Gain:
        after = self.parts(self.states_after(decision))
        return gain(self.losses_before, after, self.voyages)

    def adapted(self, decision: Decision) -> Gain:
        """What the model's own coefficients take off alone, fitted again with nothing named."""
        return self.gain(
            replace(decision, named=(), point=decision.first, base=decision.nothing, apart={})
        )

    def extended(self, decision: Decision) -> ExtendedSimulator:
        """The model with what is named in it, with numbers from all voyages."""
        named, beside = decision.named, None
        if decision.adapted:
            trial, seen = self.simulated(decision)
            beside = trial.coefficients(seen.point, seen.base)
        return self.before.with_causes(
            [n.cause for n in named], {n.cause.label: n.numbers for n in named},
            {n.cause.label: n.covariance for n in named}, self._constants(decision), beside,
        )  # fmt: skip

    def simulated(self, decision: Decision) -> tuple[Trial, Decision]:
        """The model that is simulated on the trial's segments, with what is named in it."""
        return (self.trial, decision) if self.own is None else self.own.beside(decision)

    def refuted(self, decision: Decision) -> tuple[Decision, Gain | None, dict[str, str]]:
        """What is left of a decision, its gain, and label → why not of what is not.

        A cause of the error makes it less, and surely so where little evidence speaks for it: what
        is outside the catalogue looks a little like something in it. An instrument's fault is a
        fault though it is worth nothing, but not where it makes the error more; so is what differs
        from its nominal campaign beyond doubt, where held-out voyages cannot tell gain from loss:
        steps of a second hide a lag of a third of one. A model that has learned of it, and gains
        by being fitted again beside it, is so without each cause, too. Of two voyages the other
        need not know what one shows: what is there beyond doubt is asked again by their halves.
        """
        dropped: dict[str, str] = {}
        few = len(set(self.voyages)) < VOYAGES
        if not decision.named:
            return decision, None, dropped
        found = self.gain(decision)
        if self.trial.reference.adapts:
            decision, found = self.better(decision, found)
        while decision.named:
            harm = found.after > HARM * found.before
            asked = [n for n in decision.named if harm or not n.cause.only_read]
            alone = len(decision.named) == 1
            if not asked or (found.low > 0.0 and alone and not decision.adapted):
                break
            tried = []
            for one in asked:
                rest = decisions.without(self.trial, decision, one)
                tried.append((self.worth(rest, decision), rest, one))
            worth, rest, one = min(tried, key=lambda t: t[0].before)
            gains = worth.reduction >= (0.0 if alone else WORTH)
            if gains and (worth.low > 0.0 or not alone or one.evidence >= diagnose.MORE):
                break
            undecided = worth.high > (0.0 if alone else WORTH)
            if not harm and undecided and self._sure(one, alone):
                break
            if few and not self._halved(decision) and self._sure(one, alone):
                decision = replace(decision, halves=True)
                found = self.gain(decision)
                continue
            why = f"{worth.reduction:+.1%}"
            if gains:
                why = f"{why}, {worth.low:+.1%} to {worth.high:+.1%}: none that is sure"
            dropped[one.cause.label] = f"no gain on held-out voyages ({why})"
            left = {n.cause.label for n in rest.named}
            dropped |= {
                other: f"{one.cause.label} explains {nats:.0f} nats more, and gains nothing"
                for other, nats in one.beaten.items() if nats > diagnose.MORE and other not in left
            }  # fmt: skip
            decision = replace(rest, halves=False)
            found = self.gain(decision)
        return decision, found if decision.named else None, dropped

    def better(self, decision: Decision, found: Gain) -> tuple[Decision, Gain]:
        """The same with the model's own coefficients fitted again beside what is named, where that
        makes the error less."""
        beside = replace(decision, adapted=True)
        again = self.gain(beside)
        return (beside, again) if again.after < found.after else (decision, found)

    def simulated_with(self, decision: Decision) -> tuple[Decision, Gain | None]:
        """What others named in this model, and what it is worth there."""
        plain = replace(decision, adapted=False)
        if not decision.named:
            return plain, None
        found = self.gain(plain)
        return self.better(plain, found) if self.trial.reference.adapts else (plain, found)

    def worth(self, rest: Decision, decision: Decision) -> Gain:
        """What a decision takes off beside one with a cause less."""
        return gain(
            self.parts(self.states_after(rest)), self.parts(self.states_after(decision)),
            self.voyages,
        )  # fmt: skip

    def _sure(self, one: Named, alone: bool) -> bool:
        """Whether it differs from its nominal campaign beyond doubt, or from all that a smooth
        function of a network's inputs says."""
        ref = self.trial.reference
        wanted = diagnose.SURE * (1.0 if alone else BESIDE)
        return (ref.nominal is not None or ref.learned) and one.evidence > wanted

    def chosen(self, decision: Decision) -> tuple[Decision | None, dict[str, str]]:
        """Beside a model that nobody fitted: instruments by evidence, and of the causes of the
        error those that take most off voyages left out. None where there are too few voyages, or
        no such cause."""
        if len(set(self.voyages)) < VOYAGES:
            return None, {}
        ref = self.trial.reference
        read = tuple(n for n in decision.named if n.cause.only_read)
        others = [
            c for c in ref.model.causes if not c.only_read and c.label not in self.trial.fixed
        ]
        needed = constants_of(others, ref.setting)
        search = direct.search_of(self.before, others, ref.setting, self.cut, needed)
        selected = direct.select(search)
        refused = dict(selected.refused)
        if not selected.numbers:
            return None, refused
        by = {c.label: c for c in others}
        named = tuple(
            Named(
                by[label], float("nan"), selected.probability[label], numbers,
                selected.covariance[label], freedom=ref.freedom,
            )
            for label, numbers in selected.numbers.items()
        )  # fmt: skip
        for one in decision.named:
            if not one.cause.only_read and one.cause.label not in by:
                refused[one.cause.label] = f"{' and '.join(selected.numbers)} take more off"
        chosen = replace(
            decision, verdict="named", named=(*named, *read), structure=None, apart=selected.without
        )
        return chosen, refused

    def lost(self, found: Gain | None) -> str:
        """Why no name would be believed: a sign turned round does far more for the rollouts than
        all that was named, or they are worse than a ship that keeps its velocities, with what was
        named in them too. Empty where neither holds."""
        own = float(self.losses_before.sum(1).mean())
        after = own if found is None else min(own, found.after)
        hold = float(self.parts(self.measured[:, :1]).sum(1).mean())
        other, turned = conventions.best(self.before, self.cut)
        if turned < min(TURNED * after, hold):
            return f"L is {turned:.0f} with {other}, and {own:.0f} as log and profile have it"
        if own <= LOST * hold or after <= hold:
            return ""
        return (
            f"The model is worse than one that keeps its velocities (L {own:.0f}, that one "
            f"{hold:.0f})"
        )

    def _constants(self, decision: Decision) -> dict[str, np.ndarray]:
        return constants_of((n.cause for n in decision.named), self.trial.reference.setting)

    def left_out(self, decision: Decision) -> str:
        """What of each window the numbers have not seen."""
        return "its half of the voyage" if self._halved(decision) else "its voyage"

    def _halved(self, decision: Decision) -> bool:
        """Whether halves of voyages are left out: where it says so, and of one alone."""
        return decision.halves or len(set(self.voyages)) == 1

    def _folds(self, halves: bool) -> Iterator[tuple[str, Half, torch.Tensor]]:
        """(voyage, half of it, window rows) that are left out: whole voyages, or `halves`."""
        elapsed = self.cut.plan["elapsed"].to_numpy()
        for name in dict.fromkeys(self.voyages):
            own = np.array([n == name for n in self.voyages])
            if not halves:
                yield name, None, torch.tensor(np.flatnonzero(own))
                continue
            first, last = elapsed[own].min(), elapsed[own].max()
            middle = 0.5 * (first + last + float(self.cut.dt[0].sum()))
            for late in (False, True):
                rows = torch.tensor(np.flatnonzero(own & ((elapsed >= middle) == late)))
                if len(rows):
                    yield name, (middle, late), rows

    def _without(
        self, decision: Decision, voyage: str, half: Half
    ) -> tuple[dict[str, np.ndarray], np.ndarray | None]:
        """Numbers of the named causes from all else alone, and the coefficients beside them where
        the model adapts."""
        recorded, segment = self.trial.record, decision.point.linear.cut
        index = recorded.names.index(voyage) if voyage in recorded.names else -1
        out = segment.voyage == index
        if half is not None:
            middle, late = half
            out &= (recorded.time[segment.rows] >= middle) == late
        included = tuple(decision.base.numbers)
        numbers, coefficients = dict(decision.apart.get(voyage, {})), None
        if included or decision.adapted:
            fitted, beside = self.trial.without(decision.point, included, decision.louder, out)
            numbers = {**fitted, **numbers}
            if self.own is not None and decision.adapted:
                trial, seen = self.own.beside(decision)
                _, beside = trial.without(seen.point, tuple(seen.base.numbers), seen.louder, out)
            coefficients = beside if decision.adapted else None
        return {n.cause.label: numbers[n.cause.label] for n in decision.named}, coefficients
