"""What was decided and what it rests on, as the verdict that is written down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from shiplog.diagnosis import error_location, next_manoeuvre, segments
from shiplog.diagnosis.evidence import TrialEvidence
from shiplog.diagnosis.held_out import HeldOut
from shiplog.diagnosis.interval import Interval
from shiplog.diagnosis.linear_segments import Linear
from shiplog.diagnosis.omitted_inputs import Dependence
from shiplog.diagnosis.result import Decision
from shiplog.report import verdict as verdicts
from shiplog.report.verdict import Verdict
from shiplog.simulation.error_reduction import Gain
from shiplog.simulation.extended_simulator import ExtendedSimulator
from shiplog.training.load_model import Run
from shiplog.voyages import timescale
from shiplog.voyages.recording import Record

MOSTLY = 0.5  # share of the windows that makes `coverage` the answer
# Families that a model is wrong in where it never was; its own error there looks like noise, too.
SEEN = ("wind", "motion", "controls", "stochastic")
LEAST_S = 240.0  # of unbroken record, below which nothing can be said


@dataclass(frozen=True)
class DiagnosedTrial:
    """The verdict and what it rests on.

    seen    trial and decision of the model that is simulated: for a network, not those that judge
    whole   as that stood, on overlapping segments
    held    the windows; None where no stretch was long enough for one
    after   the extended model; None where nothing was named
    """

    verdict: Verdict
    folder: Path
    decision: Decision | None = None
    trial: TrialEvidence | None = None
    seen: tuple[TrialEvidence, Decision] | None = None
    whole: Linear | None = None
    held: HeldOut | None = None
    after: ExtendedSimulator | None = None

    @property
    def recording(self) -> Path | None:
        """Its pictures, where there is something to show."""
        return None if self.decision is None else self.folder / "diagnosis.rrd"


@dataclass(frozen=True)
class Context:
    """What a verdict says besides what was decided.

    before_effect   whether the model was made on voyages before these, and they are known
    untested        label → why it could not be tested
    dropped         label → why held-out voyages refute it
    lost            why no name would be believed; empty where one would
    segment         s, how long the segments were
    alone           what the model takes off fitted again with nothing named, where it is fitted
                    again beside what is named
    """

    run: Run
    before_effect: bool
    untested: Mapping[str, str] = field(default_factory=dict)
    dropped: Mapping[str, str] = field(default_factory=dict)
    lost: str = ""
    notes: Sequence[str] = ()
    pushed: Sequence[Interval] = ()
    segment: float = timescale.SEGMENT_S
    uncovered: Sequence[Interval] = ()
    wrong: Sequence[dict] = ()
    unseen: Sequence[Dependence] = ()
    alone: float | None = None


def verdict(
    trial: TrialEvidence,
    decision: Decision,
    found: Gain | None,
    held: HeldOut | None,
    context: Context,
) -> Verdict:
    """What was decided, in the contract's words.

    found   the gain of what is named; None where nothing is, or there are no windows
    held    the windows it was measured on
    """
    rejected, notes = dict(decision.rejected) | dict(context.dropped), list(context.notes)
    if context.lost:
        notes.insert(
            0, f"{context.lost}. It does not simulate this ship, or its profile reads it wrongly."
        )
    named = {n.cause.label for n in decision.named}
    rejected = {k: why for k, why in rejected.items() if k not in named}
    unavailable = verdicts.rejected_json(context.untested)
    advised = next_manoeuvre.advice(trial, decision.named, decision.first.numbers)
    causes = [verdicts.cause_json(n, advised.get(n.cause.label)) for n in decision.named]
    if decision.pulses is not None:
        times = error_location.pulses(trial, decision, decision.pulses)
        sure = decision.ranking.get("unknown:intermittent", 0.0)
        causes.append(verdicts.pulses_json(decision, times, sure))
    said = _word(decision, bool(causes), held, context)
    structure = verdicts.structure_json(decision, context.run.profile.actuator_names)
    ranking = verdicts.probabilities_json(decision.ranking)
    sentence = f"{context.lost}: no cause can be told."
    if not context.lost:
        sentence = verdicts.sentence(
            said, causes, structure, found, decision.louder, context.alone, ranking, context.wrong
        )  # fmt: skip
    setting, catalogue = trial.reference.setting, trial.reference.model.causes
    return Verdict(
        verdict=said,
        said=sentence,
        run=context.run.name,
        before_effect=context.before_effect,
        made=_made(context.run, context.before_effect),
        causes=tuple(causes),
        ranking=ranking,
        rejected=verdicts.rejected_json(rejected),
        traces=tuple(verdicts.trace_json(n) for n in decision.traces),
        structure=structure if said == "unknown" else None,
        intervals=(*context.pushed, *context.uncovered),
        gain=found if causes else None,
        without="" if held is None else held.left_out,
        wrong=tuple(context.wrong),
        unseen=tuple(verdicts.unseen_json(row) for row in context.unseen),
        limits=verdicts.limits_json(decision, catalogue, setting),
        unavailable=unavailable,
        notes=tuple(notes),
    )


def of_physics(run: Run, trial: TrialEvidence, found: Gain | None) -> list[str]:
    """Whom the causes of a network were asked of, and what they are worth there."""
    where = "these voyages" if trial.reference.adapts else "the voyages that it was made on"
    said = [
        f"{run.name} is a network: the causes are those that the ship's MMG lacks, fitted to "
        f"{where}."
    ]
    if found is not None:
        said.append(
            f"On the same windows that MMG has an error "
            f"{verdicts.less(found.reduction)} with them ({verdicts.less(found.low)} to "
            f"{verdicts.less(found.high)})."
        )
    return said


def _word(decision: Decision, named: bool, held: HeldOut | None, context: Context) -> str:
    """named, none, unknown, coverage or external."""
    if named:
        return "named"
    family = decision.structure.family if decision.structure else ""
    unseen = held is not None and len(context.uncovered) > MOSTLY * len(held.cut)
    if decision.verdict == "unknown" and not context.lost and family in SEEN and unseen:
        return "coverage"
    # shorter than a segment altogether, such stretches are listed, and no answer for the trial
    pushed = sum(one.end_s - one.start_s for one in context.pushed)
    if decision.verdict == "none" and pushed >= context.segment:
        return "external"
    return decision.verdict


def _made(run: Run, before_effect: bool) -> str:
    if run.given:
        return "of coefficients that were not fitted to these voyages"
    return "on voyages before these" if before_effect else "on these very voyages"


def enough(recorded: Record) -> bool:
    """Whether anything can be said of it."""
    return recorded.seconds >= LEAST_S and len(segments.begins(recorded)) >= 4


def runs_away(run: Run, before_effect: bool) -> Verdict:
    """Where no path of the model can be computed: there is nothing to compare."""
    said = (
        "Nothing can be told: the model runs away on these voyages, or on those that it was made "
        "on, so that its errors say nothing. Check signs, units and places in the profile, compare "
        "the model with its baselines (`shiplog evaluate`), and identify it again from more "
        "voyages."
    )
    return Verdict("undecided", said, run.name, before_effect)


def too_little(run: Run, recorded: Record, before_effect: bool) -> Verdict:
    short = max(LEAST_S - recorded.seconds, recorded.timescale.seconds * 4 - recorded.seconds, 0.0)
    said = (
        f"Too little for a verdict: {recorded.seconds:.0f} s can be used and {LEAST_S:.0f} s in "
        f"unbroken stretches of {recorded.timescale.seconds:.0f} s are needed. "
        f"Log at least {short:.0f} s more, with turns both ways, a stop, and runs on several "
        "headings."
    )
    return Verdict("coverage", said, run.name, before_effect)
