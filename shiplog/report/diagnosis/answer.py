"""The result of a diagnosis as the verdict that is written: word, sentence, tables, notes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import intermittent
from shiplog.diagnosis.linear import segments
from shiplog.diagnosis.onset.onsets import Course
from shiplog.diagnosis.residual import next_manoeuvre
from shiplog.diagnosis.residual.interval import Interval
from shiplog.diagnosis.residual.omitted_inputs import Dependence
from shiplog.diagnosis.season.trends import OfVoyage
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict import contradicted_causes
from shiplog.diagnosis.verdict.held_out import HeldOut
from shiplog.diagnosis.verdict.result import Decision
from shiplog.exceptions import listed
from shiplog.models.causes import CATALOGUE, Cause
from shiplog.report.diagnosis.sections import causes as named_causes
from shiplog.report.diagnosis.sections import contradictions as contradicting
from shiplog.report.diagnosis.sections import limits as smallest
from shiplog.report.diagnosis.sections import ranking as rankings
from shiplog.report.diagnosis.sections import reasons, traces, unseen, wrong
from shiplog.report.diagnosis.sections import structure as structures
from shiplog.report.diagnosis.sections.structure import Structure
from shiplog.report.diagnosis.verdict import Verdict
from shiplog.report.diagnosis.verdict_sentence import less, sentence
from shiplog.ship_profile import differences as profile_differences
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.error_reduction import Gain
from shiplog.training.runs.load_model import Run
from shiplog.voyages.rows import timescale
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store import contradicted as contradictions
from shiplog.voyages.store import parts
from shiplog.voyages.store.contradicted import Contradicted

OTHERWISE = "the profile reads these logs otherwise than those of the model"
FEWEST_SEGMENTS = 4  # that a verdict needs
# Families in which a model errs outside its training data; such an error resembles noise, too.
INPUTS = ("wind", "motion", "controls", "stochastic")
OPEN = ("unknown", "undecided")  # what may be such an error
LEAST_CANDIDATE = 0.1  # probability of an answer that is worth a test of its own


@dataclass(frozen=True)
class Context:
    """What a verdict reports in addition to the decision.

    before_effect   whether the model was trained on earlier voyages that are in the store
    untested        label → why it could not be tested
    dropped         label → why held-out voyages refute it
    lost            why no cause can be named; empty where one can
    segment         length of the segments, s
    alone           share of the error that a second fit without any cause removes; None where the
                    model is not fitted again together with the causes
    against         short stretches that contradict themselves
    courses         label → since when a named cause acts
    seasons         label → a named cause in each voyage
    """

    run: Run
    before_effect: bool
    untested: Mapping[str, str] = field(default_factory=dict)
    dropped: Mapping[str, str] = field(default_factory=dict)
    lost: str = ""
    notes: Sequence[str] = ()
    external: Sequence[Interval] = ()
    segment: float = timescale.SEGMENT_S
    uncovered: Sequence[Interval] = ()
    wrong: Sequence[dict] = ()
    unseen: Sequence[Dependence] = ()
    alone: float | None = None
    against: Sequence[Contradicted] = ()
    courses: Mapping[str, Course] = field(default_factory=dict)
    seasons: Mapping[str, Sequence[OfVoyage]] = field(default_factory=dict)


def verdict(
    trial: Trial,
    decision: Decision,
    found: Gain | None,
    held: HeldOut | None,
    context: Context,
) -> Verdict:
    """The decision in the contract's words.

    found   gain of the named causes; None without causes or windows
    held    the windows of that gain
    """
    rejected, notes = dict(decision.rejected) | dict(context.dropped), list(context.notes)
    if context.lost:
        notes.insert(0, f"{context.lost}. The model is not of this ship, or the profile is wrong.")
    if held is not None and held.not_counted:
        number = held.not_counted
        notes.append(f"Windows in which the model diverges, in none of the figures: {number}.")
    named = {n.cause.label for n in decision.named}
    rejected = {k: why for k, why in rejected.items() if k not in named}
    unavailable = reasons.of(context.untested)
    advised = next_manoeuvre.advice(trial, decision.named, decision.nothing.point.numbers)
    causes = [
        named_causes.of_named(
            n, advised.get(n.cause.label), context.courses.get(n.cause.label),
            context.seasons.get(n.cause.label, ()),
        )
        for n in decision.named
    ]  # fmt: skip
    if decision.side_force is not None:
        times = intermittent.active_intervals(trial, decision.fit, decision.side_force)
        causes.append(named_causes.of_side_force(decision, times))
    word = _word(decision, bool(causes), held, context)
    if context.against and word in ("unknown", "coverage"):
        word = "undecided"
    structure = structures.of(decision, context.run.profile.actuator_names)
    ranking = rankings.of(decision.ranking)
    setting, catalogue = trial.reference.setting, trial.reference.model.causes
    limits = smallest.of(decision, catalogue, setting)
    hidden = smallest.not_shown(limits)
    errors = wrong.of(context.wrong)
    text = f"{none_named(context.lost)}."
    if not context.lost:
        text = sentence(
            word, causes, structure, found, decision.fit.noise_factor, context.alone,
            ranking=ranking, wrong=errors, one_of=decision.one_of, either=decision.either,
            why=decision.why, hidden=hidden,
        )  # fmt: skip
    if context.against:  # first, whatever is said of the rest
        open_ = "No cause explains the rest." if word == "undecided" else text
        text = f"{contradictions.text(context.against)} {open_}"
    if word == "undecided":
        notes += tests_of_open(decision.ranking, catalogue)
    return Verdict(
        verdict=word,
        sentence=text,
        run=context.run.name,
        before_effect=context.before_effect,
        made=made_of(context.run, trial.record),
        causes=tuple(causes),
        ranking=ranking,
        rejected=reasons.of(rejected),
        traces=traces.of(decision.traces),
        structure=structure if word == "unknown" else None,
        intervals=(*context.external, *context.uncovered),
        gain=found if causes else None,
        without="" if held is None else held.left_out,
        wrong=errors,
        unseen=tuple(map(unseen.of, context.unseen)),
        limits=limits,
        hidden=hidden,
        contradictions=contradicting.of(context.against),
        unavailable=unavailable,
        notes=tuple(notes),
    )


def none_named(lost: str) -> str:
    """Why a cause is not named: what `HeldOut.lost` says of the model."""
    return f"{lost}: no cause can be named"


def without_nominal(run: Run, store: Path) -> str:
    """A note where the store has no voyage that the run was trained on, or too little of them."""
    return (
        f"{store} has none of the training voyages of {run.name}, or too little of them for a "
        "nominal campaign. Without one, causes that a new fit would absorb are not tested. Ingest "
        "these voyages, or record more of them and identify the model again."
    )


def tests_of_open(ranking: Mapping[str, float], causes: Sequence[Cause]) -> list[str]:
    """Notes on an undecided verdict: the test of each two candidates that the catalogue knows how
    to separate.

    ranking   name → probability
    """
    by = {c.name: c for c in causes}
    candidates = [
        by[name] for name, p in ranking.items()
        if name in by and LEAST_CANDIDATE <= p < thresholds.STATED
    ]  # fmt: skip
    return [
        f"A test that separates {one.name} from {other.name}: {test}."
        for one, other in combinations(candidates, 2)
        if (test := one.separated_by.get(other.name) or other.separated_by.get(one.name))
    ]


def read_otherwise(run: Run, profile: Profile) -> list[str]:
    """A note where these voyages were read otherwise than those of the model."""
    if not (keys := profile_differences.readings(run.profile, profile)):
        return []
    return [
        f"These voyages were read with another unit, sign, zero or order of {listed(keys)} than "
        f"those of {run.name}, from the same fields. If no instrument was changed, one of the two "
        "profiles is wrong, and a cause that is named may be no change of the ship."
    ]


def of_given(run: Run) -> str:
    """A note on a model that was fitted to no voyage."""
    return (
        f"No voyage shows what {run.name} itself gets wrong of this ship. A named cause may stand "
        "for an error of its coefficients: confirm it by a measurement that needs no model, or "
        "identify the model from nominal voyages."
    )


def of_own_voyages(run: Run, trial: Trial, decision: Decision) -> list[str]:
    """Notes on a verdict without a nominal campaign, such as one about a run's own voyages."""
    notes = []
    if run.judges_itself and _on_its_own(run, trial.record):
        notes.append(
            f"{run.name} was fitted to these very voyages and may have absorbed a part of the "
            "cause. The numbers are then those of the residual, and too small."
        )
    if decision.adapted:
        notes.append(f"{run.name} is fitted again together with the named causes.")
    return notes


def of_physics(run: Run, trial: Trial, found: Gain | None) -> list[str]:
    """Notes for a network: which MMG the causes were tested on, and their gain there."""
    where = "these voyages" if trial.reference.adapts else "the network's training voyages"
    notes = [
        f"{run.name} is a network. The causes were tested on an MMG of the ship that was fitted to "
        f"{where}."
    ]
    if found is not None:
        notes.append(
            f"On the same windows that MMG has an error "
            f"{less(found.reduction)} with them ({less(found.low)} to "
            f"{less(found.high)})."
        )
    return notes


def _word(decision: Decision, named: bool, held: HeldOut | None, context: Context) -> str:
    """named, none, unknown, undecided, coverage or external."""
    if named:
        return "named"
    family = decision.structure.family if decision.structure else ""
    most = thresholds.UNCOVERED_WINDOWS
    unseen = held is not None and len(context.uncovered) > most * len(held.cut)
    if decision.verdict in OPEN and not context.lost and family in INPUTS and unseen:
        return "coverage"
    # less than a segment in all is listed, but is no answer for the trial
    external_s = sum(one.end_s - one.start_s for one in context.external)
    if decision.verdict == "none" and external_s >= context.segment:
        return "external"
    return decision.verdict


def made_of(run: Run, recorded: Record) -> str:
    """What the model was fitted to, whether or not the store has that."""
    if run.given:
        return "with coefficients that were not fitted to these voyages"
    own = _on_its_own(run, recorded)
    return "fitted to these very voyages" if own else "fitted to earlier voyages"


def _on_its_own(run: Run, recorded: Record) -> bool:
    return bool(parts.overlapping(recorded.names, run.trained_on))


def contradicted(
    run: Run, recorded: Record, before_effect: bool, found: Sequence[Contradicted]
) -> Verdict:
    """The verdict while a gross contradiction stands: whatever a cause would be fitted to is
    wrong, and none is tested."""
    sentence = (
        f"{contradictions.text(found)} No verdict: no cause is tested against such rows. Correct "
        "the profile, ingest these logs again, and diagnose again."
    )
    why = contradicted_causes.all_causes_barred(contradictions.channels(found), run.profile)
    return Verdict(
        "undecided", sentence, run.name, before_effect, made_of(run, recorded),
        unavailable=reasons.of(why), contradictions=contradicting.of(found),
    )  # fmt: skip


def other_convention(
    run: Run, recorded: Record, before_effect: bool, why: str, found: Sequence[Contradicted] = (),
    notes: Sequence[str] = (),
) -> Verdict:  # fmt: skip
    """The verdict where the profile reads these logs otherwise than those of the model: all that
    the trial has more than the nominal voyages goes with one sign, place or unit.

    why   as `sign_conventions.sufficient_convention` has it
    """
    said = f"{contradictions.text(found)} {none_named(why)}.".strip()
    structure = Structure("motion", (), structures.DEPENDS["motion"], 0.0)
    note = (
        "No search for causes was made: correct the profile of these logs, ingest them again, and "
        "diagnose again."
    )
    return Verdict(
        "unknown", said, run.name, before_effect, made_of(run, recorded), structure=structure,
        unavailable=reasons.of({c.name: OTHERWISE for c in CATALOGUE}),
        notes=(*notes, note), contradictions=contradicting.of(found),
    )  # fmt: skip


def enough(recorded: Record) -> bool:
    """Whether the record is long enough for a verdict."""
    return (
        recorded.seconds >= thresholds.LEAST_RECORD_S
        and len(segments.begins(recorded)) >= FEWEST_SEGMENTS
    )


def runs_away(run: Run, recorded: Record, before_effect: bool) -> Verdict:
    """The verdict where the model diverges on every segment: there is nothing to compare."""
    sentence = (
        "No verdict: the model diverges on these voyages or on its training voyages. Check signs, "
        "units and positions in the profile. Compare the model with its baselines (`shiplog "
        "evaluate`), or identify it again from more voyages."
    )
    return Verdict("undecided", sentence, run.name, before_effect, made_of(run, recorded))


def too_little(run: Run, recorded: Record, before_effect: bool) -> Verdict:
    least, segment = thresholds.LEAST_RECORD_S, recorded.timescale.seconds
    lacking = FEWEST_SEGMENTS - len(segments.begins(recorded))
    used = round(recorded.seconds)
    if recorded.seconds < least:  # what is a part of a second short is short
        used = min(used, round(least) - 1)
    short = max(least - used, lacking * segment)
    sentence = (
        f"Too little for a verdict: {used} s can be used, and {least:.0f} s are "
        f"needed in unbroken stretches of {segment:.0f} s. "
        f"Log at least {short:.0f} s more, with turns both ways, a stop, and runs on several "
        "headings."
    )
    return Verdict("coverage", sentence, run.name, before_effect, made_of(run, recorded))
