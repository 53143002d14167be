"""A model and voyages to a verdict: what is wrong, why, the extended model, the gain."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
import torch

from pipelines.prepare import seconds
from pipelines.provenance import Answer, provenance
from pipelines.split import plan
from shiplog import causes as catalogue
from shiplog import coverage as covering
from shiplog import (
    diagnose,
    direct,
    external,
    record,
    reference,
    remembered,
    runs,
    segments,
    table,
    unexplained,
    unseen,
    user_causes,
    windows,
    wrong,
)  # fmt: skip
from shiplog import verdict as verdicts
from shiplog.causes import Cause, Setting
from shiplog.diagnose import Decision, Named, Structure
from shiplog.exceptions import RunError, StoreError, listed
from shiplog.extend import ExtendedSimulator, campaign
from shiplog.gain import Gain, gain, parts
from shiplog.hypotheses import Point, Trial
from shiplog.models import mmg
from shiplog.models.extended import Extended
from shiplog.record import Record
from shiplog.reference import Start
from shiplog.runs import Run
from shiplog.segments import Linear
from shiplog.sensitivity import series
from shiplog.store import Store
from shiplog.verdict import Interval, Verdict
from shiplog.windows import Windows

log = logging.getLogger(__name__)

LEAST_S = 240.0  # of unbroken record, below which nothing can be said
PLACES = 12  # of a map of the bottom
UNCOVERED = 0.5  # share of a window's seconds outside the training data
REFUTED = 3  # times that the verdict is looked for again without what did not hold
WORTH = 0.02  # of the error, that each of several causes must take off held-out windows
MOSTLY = 0.5  # share of the windows that makes `coverage` the answer
SEEN = ("wind", "motion", "controls")  # families that a model is wrong in where it never was
LOST = 2.0  # times the L of keeping all velocities, from which on a model simulates nothing
HARM = 1.2  # times the error, from which on even an instrument's fault is refuted
VOYAGES = 3  # fewer cannot choose causes by voyages left out
PULSE_SURE = 0.5  # of the strongest: where the thruster counts as on


@dataclass(frozen=True)
class Diagnosis:
    """The verdict and what it rests on."""

    verdict: Verdict
    decision: Decision | None
    trial: Trial | None
    whole: Linear | None  # as the model stood, on overlapping segments
    windows: Windows | None
    before: ExtendedSimulator | None
    after: ExtendedSimulator | None
    folder: Path

    @property
    def recording(self) -> Path | None:
        """Its pictures, where there is something to show."""
        return None if self.decision is None else self.folder / "diagnosis.rrd"


def diagnose_run(
    run_path: Path,
    store: Store,
    voyages: Sequence[str],
    out: Path,
    *,
    extend: Path | None = None,
    cause_files: Sequence[Path] = (),
) -> Diagnosis:
    """The whole way. Raises ShiplogError."""
    began = time.time()
    run = runs.load(run_path)
    names = _trial_voyages(run, store, voyages)
    profile = store.profile(names)
    if profile.columns != run.profile.columns or profile.ship.name != run.profile.ship.name:
        raise RunError(
            f"{run.name} is of {run.profile.ship.name!r} with {listed(run.profile.columns)}; the "
            f"voyages are of {profile.ship.name!r} with {listed(profile.columns)}.",
            hint="diagnose a ship with a model of her own.",
        )
    trained = [*run.config.split.training, *run.config.split.validation]
    before_effect = not set(names) & set(trained) and run.config.physics.fit
    recorded = _record(store, names, profile)
    notes: list[str] = []
    if recorded.seconds < LEAST_S or len(segments.begins(recorded)) < 4:
        return _too_little(run, recorded, before_effect, out)
    nominal = None
    if before_effect:
        stored = {entry.name for entry in store.entries()}
        there = [n for n in trained if n in stored]
        if there:
            nominal = _record(store, there, profile)
        if nominal is None or len(segments.begins(nominal)) < 8:
            nominal = None
            notes.append(
                f"The voyages {run.name} was made on are not in {store.path}: what is usual for "
                "this ship is not known, and causes that another fit would absorb are not tested."
            )
    trial, untested = trial_of(run, nominal, recorded, cause_files)
    log.info(
        "%s against %s: %d segments of %d s, κ %.0f",
        listed(names, most=4), run.name, len(trial.rows), segments.SECONDS,
        trial.reference.kappa,
    )  # fmt: skip
    point = trial.begin(run.extension_numbers())
    whole = trial.covering(point)
    pushed = _external(trial, point, whole)
    cut = _windows(run, store, names, profile)
    before = run.extended(run.config.seeds[0], recorded)
    dropped: dict[str, str] = {}
    for _ in range(REFUTED):  # what held-out voyages refute may have hidden what they do not
        decision = diagnose.decide(trial, point, dropped)
        after, found, decision, refuted = _gain(trial, decision, cut, before)
        dropped |= refuted
        if not refuted:
            break
    if run.config.physical and not run.config.physics.fit and cut is not None:
        chosen, refused = _chosen(trial, decision, cut, before)
        dropped |= refused
        if chosen is not None:
            decision = chosen
            after, found = _worth(trial, decision, cut, before)
    verdict = _verdict(
        run, decision, found, before_effect and nominal is not None, untested, dropped, notes,
        _uncovered(run, store, names, profile, cut), 0 if cut is None else len(cut), trial, pushed,
        _wrong(trial, before, cut, profile), _unseen(trial, decision, whole),
        _lost(cut, before, found),
    )  # fmt: skip
    done = Diagnosis(verdict, decision, trial, whole, cut, before, after, out)
    _save(done, run, store, names, began)
    if extend is not None:
        _extend(run, done, extend, cause_files)
    return done


def _trial_voyages(run: Run, store: Store, voyages: Sequence[str]) -> list[str]:
    if voyages:
        return store.select(list(voyages))
    used = {*run.config.split.training, *run.config.split.validation}
    names = [n for n in store.select() if n not in used]
    if not names:
        raise StoreError(
            f"Every voyage in {store.path} was used to make {run.name}.",
            hint="name some with --voyages, or ingest voyages it has not seen.",
        )
    return names


def _record(store: Store, names: Sequence[str], profile) -> Record:
    return record.read([frame.collect() for frame in store.tables(names)], names, profile)


def trial_of(
    run: Run, nominal: Record | None, recorded: Record, cause_files: Sequence[Path]
) -> tuple[Trial, dict[str, str]]:
    """Reference and trial; which causes cannot be tested, and why."""
    usual = nominal if nominal is not None else recorded
    setting = setting_of(run, usual, recorded)
    given = run.config.physical and not run.config.physics.fit
    extension = run.extension
    held = {} if extension is None else {c.label: c for c in extension.causes}
    own = [c for c in catalogue.CATALOGUE if c.label not in held]
    others = [c for c in user_causes.load(cause_files) if c.label not in held]
    untested: dict[str, str] = {}
    chosen = list(held.values())  # they are in the model, testable here or not
    for cause in (*own, *others):
        missing = _missing(cause, setting, absorbed=nominal is None and not given)
        if missing is not None:
            untested[cause.label] = missing
        else:
            chosen.append(cause.on(setting))
    model, start = _model(run, chosen, setting)
    if nominal is None:
        known = reference.assume(model, setting, start, recorded, given=given)
        return Trial(known, recorded, tuple(held)), untested
    # where the nominal voyages settle depends on them alone, so that it can be kept
    before = setting_of(run, nominal, nominal)
    testable = [c.on(before) for c in catalogue.CATALOGUE if c.missing(before) is None]
    at = remembered.settled(_model(run, testable, before)[0], before, start, nominal)
    known = reference.learn(model, setting, start, nominal, at)
    return Trial(known, recorded, tuple(held)), untested


def _missing(cause: Cause, setting: Setting, absorbed: bool) -> str | None:
    """Why a cause cannot be tested."""
    missing = cause.missing(setting)
    if missing is None and absorbed and cause.absorbed:
        return "a model fitted to these voyages absorbs it"
    return missing


def _model(run: Run, causes: Sequence[Cause], setting: Setting) -> tuple[Extended, Start]:
    """The run's model with room for these causes, and where its coefficients stand."""
    base, start, stand_in, values = run.base()
    constants: dict[str, np.ndarray] = {}
    for cause in causes:
        constants |= cause.constants(setting)
    if run.extension is not None:
        constants |= run.extension.constants
    return Extended(base, tuple(causes), stand_in, values, constants), start


def setting_of(run: Run, usual: Record, recorded: Record) -> Setting:
    speed = float(np.sqrt((usual.state[:, [1, 3]] ** 2).sum(1).mean()))
    _, main, _ = mmg.geometry_of(run.profile, run.config.physics.without)
    places, spacing = reference.places(recorded, PLACES)
    scale = {
        "speed": max(speed, 1e-3), "length": main.length, "mass": main.mass,
        "moment": main.mass * main.length,
    }  # fmt: skip
    return Setting(run.profile, scale, places, spacing)


def _windows(run: Run, store: Store, names: Sequence[str], profile) -> Windows | None:
    rows = table.with_elapsed(seconds(store, names, profile))
    planned = plan(rows, "ref", run.config.window)
    if planned.height == 0:
        return None
    return windows.cut(rows, planned, run.config.window, profile.actuator_names, profile.wind_names)


def _gain(
    trial: Trial,
    decision: Decision,
    cut: Windows | None,
    before: ExtendedSimulator,
) -> tuple[ExtendedSimulator | None, Gain | None, Decision, dict[str, str]]:
    """Causes kept for what they are worth on held-out voyages; numbers without each voyage."""
    dropped: dict[str, str] = {}
    if not decision.named or cut is None:
        return None, None, decision, dropped
    steps = series(cut).steps
    measured = cut.state.double().numpy()
    usual = parts(before.states(cut, before.theta) - measured, steps)
    voyages = cut.plan["voyage"].to_list()

    def worth(decided: Decision) -> Gain:
        error = held_out(trial, decided, cut, before) - measured
        return gain(usual, parts(error, steps), voyages)

    found = worth(decision)
    # a cause of the error makes it less; an instrument's fault is a fault though it is worth
    # nothing, but not where it makes it more
    while True:
        harm = found.after > HARM * found.before
        asked = [n for n in decision.named if harm or not n.cause.only_read]
        if not asked or (found.real and len(decision.named) == 1):
            break
        tried = [
            (worth(rest), rest, one)
            for one in asked
            for rest in [diagnose.without(trial, decision, one)]
        ]
        best, rest, one = min(tried, key=lambda t: t[0].after)
        least = WORTH if len(decision.named) > 1 else 0.0
        if best.after * (1.0 - least) >= found.after:
            break
        share = 1.0 - found.after / best.after
        dropped[one.cause.label] = f"no gain on held-out voyages ({share:+.1%})"
        decision, found = rest, best
    if not decision.named:
        return None, None, decision, dropped
    return _extended(trial, decision.named, before), found, decision, dropped


def _extended(trial: Trial, named: Sequence[Named], before: ExtendedSimulator) -> ExtendedSimulator:
    return before.with_causes(
        [n.cause for n in named], {n.cause.label: n.numbers for n in named},
        {n.cause.label: n.covariance for n in named}, _constants(trial, named),
    )  # fmt: skip


def _worth(
    trial: Trial, decision: Decision, cut: Windows, before: ExtendedSimulator
) -> tuple[ExtendedSimulator, Gain]:
    """The extended model, and its gain on windows that its numbers were fitted without."""
    steps, measured = series(cut).steps, cut.state.double().numpy()
    usual = parts(before.states(cut, before.theta) - measured, steps)
    left = parts(held_out(trial, decision, cut, before) - measured, steps)
    found = gain(usual, left, cut.plan["voyage"].to_list())
    return _extended(trial, decision.named, before), found


def _chosen(
    trial: Trial, decision: Decision, cut: Windows, before: ExtendedSimulator
) -> tuple[Decision | None, dict[str, str]]:
    """Beside a model that nobody fitted: instruments by evidence, and of the causes of the error
    those that take most off voyages left out. None where there are too few voyages, or no such."""
    if cut.plan["voyage"].n_unique() < VOYAGES:
        return None, {}
    ref = trial.reference
    read = tuple(n for n in decision.named if n.cause.only_read)
    others = [c for c in ref.model.causes if not c.only_read and c.label not in trial.fixed]
    constants: dict[str, np.ndarray] = {}
    for cause in others:
        constants |= cause.constants(ref.setting)
    selected = direct.select(direct.search_of(before, others, ref.setting, cut, constants))
    if not selected.numbers:
        return None, dict(selected.refused)
    by = {c.label: c for c in others}
    named = tuple(
        Named(
            by[label], float("nan"), selected.probability[label], numbers,
            selected.covariance[label],
        )
        for label, numbers in selected.numbers.items()
    )  # fmt: skip
    refused = dict(selected.refused)
    for one in decision.named:
        if not one.cause.only_read and one.cause.label not in by:
            refused[one.cause.label] = f"{' and '.join(selected.numbers)} take more off"
    chosen = replace(
        decision, verdict="named", named=(*named, *read), structure=None, apart=selected.without
    )
    return chosen, refused


def held_out(
    trial: Trial, decision: Decision, cut: Windows, before: ExtendedSimulator
) -> np.ndarray:
    """States [N, I, 6] of every window by the extended model whose numbers are fitted without
    that window's voyage."""
    states = np.empty(tuple(cut.state.shape))
    for left, rows in _folds(cut):
        numbers = _without(trial, decision, left)
        simulator = before.with_causes(
            [n.cause for n in decision.named], numbers, None, _constants(trial, decision.named)
        )
        states[rows.numpy()] = simulator.states(cut.pick(rows), simulator.theta)
    return states


def _constants(trial: Trial, named: Sequence[Named]) -> dict[str, np.ndarray]:
    """What the named causes' forces need, and no more: it is kept with an extended run."""
    needed: dict[str, np.ndarray] = {}
    for one in named:
        needed |= one.cause.constants(trial.reference.setting)
    return needed


def _folds(cut: Windows):
    """(what is left out of the fit, window rows): whole voyages, or the halves of one alone."""
    names = cut.plan["voyage"].to_list()
    known = list(dict.fromkeys(names))
    if len(known) > 1:
        for name in known:
            rows = torch.tensor([i for i, n in enumerate(names) if n == name])
            yield (name, None), rows
        return
    elapsed = cut.plan["elapsed"].to_numpy()
    middle = 0.5 * (elapsed.min() + elapsed.max() + float(cut.dt[0].sum()))
    for late in (False, True):
        rows = torch.tensor(np.flatnonzero((elapsed >= middle) == late))
        if len(rows):
            yield (known[0], (middle, late)), rows


def _without(trial: Trial, decision: Decision, left: tuple) -> dict[str, np.ndarray]:
    """Numbers of the named causes from the other voyages alone."""
    voyage, half = left
    segment = decision.point.linear.cut
    index = trial.record.names.index(voyage) if voyage in trial.record.names else -1
    out = segment.voyage == index
    if half is not None:
        middle, late = half
        out &= (trial.record.time[segment.rows] >= middle) == late
    included = tuple(decision.base.numbers)
    numbers = trial.without(decision.point, included, decision.louder, out) if included else {}
    numbers = {**numbers, **decision.apart.get(voyage, {})}
    return {n.cause.label: numbers[n.cause.label] for n in decision.named}


def _uncovered(run: Run, store: Store, names, profile, cut: Windows | None) -> list[Interval]:
    """Windows that the training data never came near."""
    if cut is None:
        return []
    rows = table.with_elapsed(seconds(store, names, profile))
    seen = covering.of(run.training(), profile.actuator_names, profile.has_wind)
    numbered = cut.plan.select(
        "voyage", pl.int_range(pl.len()).over("voyage").alias("window"), "segment", "start",
        "elapsed",
    )  # fmt: skip
    size = run.config.window
    whole = numbered.hstack(seen.table(rows, numbered, size))
    found = []
    for row in whole.filter(pl.col("coverage") < UNCOVERED).to_dicts():
        within = rows.filter(
            (pl.col("voyage") == row["voyage"])
            & pl.col("elapsed").is_between(row["elapsed"], row["elapsed"] + size - 1)
        )
        why = covering.reason(row, within) or "unlike anything in the training data"
        found.append(
            Interval(
                row["voyage"], float(row["elapsed"]), float(row["elapsed"] + size), "coverage",
                f"Only {row['coverage']:.0%} of these seconds lie where the model was made: {why}.",
            )
        )  # fmt: skip
    return found


def _verdict(
    run, decision, found, before_effect, untested, dropped, notes, uncovered, count, trial,
    pushed, wrongs, depends, lost,
) -> Verdict:  # fmt: skip
    rejected = dict(decision.rejected) | dropped
    if lost:
        rejected |= {n.cause.label: f"{lost}: nothing can be told" for n in decision.named}
        strongest = max(decision.remains, key=lambda f: f.evidence, default=None)
        family = strongest.name if strongest else "motion"
        decision = replace(
            decision, verdict="unknown", named=(), pulses=None, traces=(),
            structure=Structure(family, strongest.evidence if strongest else 0.0, ()),
        )  # fmt: skip
        notes = [f"{lost}. It does not simulate this ship, or its profile reads her wrongly: "
                 f"what is left depends most on {family}.", *notes]  # fmt: skip
    rejected = {
        k: why for k, why in rejected.items() if k not in {n.cause.label for n in decision.named}
    }
    causes = [verdicts.cause_json(n) for n in decision.named]
    if decision.pulses is not None:
        share = diagnose.odds(decision.pulses.gain, diagnose.PULSED)
        causes.append(verdicts.pulses_json(decision, _pulses(trial, decision), share))
    structure = verdicts.structure_json(decision, run.profile.actuator_names)
    said = "named" if causes else decision.verdict
    if said == "named":
        structure = None
    family = structure["family"] if structure else ""
    if said == "unknown" and not lost and family in SEEN and len(uncovered) > MOSTLY * count:
        said = "coverage"
    if said == "none" and pushed:
        said = "external"
    limits = verdicts.limits_json(decision, trial.reference.model.causes, trial.reference.setting)
    rejected |= {k: f"not testable: {why}" for k, why in untested.items()}
    traces = [
        {
            "name": n.cause.name,
            "parameters": {k: v.as_json() for k, v in n.shown.items()},
            "sentence": f"Present, but below practical size: {n.cause.sentence(n.shown)}",
        }
        for n in decision.traces
    ]
    return Verdict(
        verdict=said,
        said=f"{lost}: no cause can be told from it."
        if lost
        else verdicts.sentence(said, causes, structure, found, decision.louder),
        run=run.name,
        before_effect=before_effect,
        made=_made(run, before_effect),
        causes=tuple(causes),
        ranking=verdicts.ranking_json(decision, said, dropped),
        rejected=verdicts.rejected_json(rejected),
        traces=tuple(traces),
        structure=structure if said == "unknown" else None,
        intervals=(*pushed, *uncovered),
        gain=found if causes else None,
        wrong=tuple(wrongs),
        unseen=tuple(depends),
        limits=limits if said in ("none", "unknown") else (),
        notes=(*notes, *verdicts.remains(decision, said)),
    )


def _lost(cut: Windows | None, before: ExtendedSimulator, found: Gain | None) -> str:
    """Why no name would be believed: rollouts worse than a ship that keeps her velocities, with
    what was named in them too. Empty where they are better."""
    if cut is None:
        return ""
    measured, steps = cut.state.double().numpy(), series(cut).steps
    hold = float(parts(measured[:, :1] - measured, steps).sum(1).mean())
    own = float(parts(before.states(cut, before.theta) - measured, steps).sum(1).mean())
    after = own if found is None else found.after
    if own <= LOST * hold or after <= hold:
        return ""
    return (
        f"The model is worse than one that keeps its velocities (L {own:.0f}, that one {hold:.0f})"
    )


def _external(trial: Trial, point: Point, whole: Linear) -> list[Interval]:
    """Stretches that no force of the ship explains; no hypothesis is judged on them."""
    ref = trial.reference
    base, _ = trial.scan(point, (), trial.fixed)
    found = external.find(
        whole, trial.solved(point, base), trial.unrest.louder(base.louder), trial.record,
        ref.model.stand_in, np.array(list(ref.coefficients.values())),
    )  # fmt: skip
    out = np.zeros(len(trial.rows), dtype=bool)
    of = np.array(trial.record.names)[trial.record.voyage[trial.rows]]
    begin = trial.record.time[trial.rows]
    for stretch in found:
        inside = (begin < stretch.end_s) & (begin + segments.SECONDS > stretch.start_s)
        out |= inside & (of == stretch.voyage)
    trial.leave_out(out)
    return [Interval(s.voyage, s.start_s, s.end_s, "external", s.sentence) for s in found]


def _wrong(trial: Trial, before: ExtendedSimulator, cut: Windows | None, profile) -> list[dict]:
    """Where the error is, channel by channel."""
    if cut is None:
        return []
    error = before.states(cut, before.theta) - cut.state.double().numpy()
    shares, _ = campaign(trial.record)
    share = [shares.get(v, (1.0, 1.0))[0] for v in cut.plan["voyage"]]
    plan_ = cut.plan.with_columns(share=pl.Series(share))
    return [c.as_json() for c in wrong.explain(error, series(cut), plan_, profile).channels]


def _unseen(trial: Trial, decision: Decision, whole: Linear) -> list[dict]:
    """What the model cannot see and the residual depends on."""
    found = unexplained.posterior(
        whole, trial.solved(decision.first, decision.nothing),
        trial.unrest.louder(decision.nothing.louder), trial.record,
    )  # fmt: skip
    knots = unexplained.table(found, trial.record)
    rows = unseen.table(knots, trial.record.profile, np.random.default_rng(0))
    return [verdicts.unseen_json(row) for row in rows]


def _pulses(trial: Trial, decision: Decision) -> list[dict]:
    """When the unrecorded thruster worked: voyage, start_s, end_s, strongest force_N and sd_N."""
    assert decision.pulses is not None
    force, sd = trial.pulse_force(decision.point, decision.base, decision.pulses)
    rows = trial.rows
    found: list[dict] = []
    strongest = float(np.quantile(np.abs(force), 0.98))
    for i, row in enumerate(rows):
        name = trial.record.names[trial.record.voyage[row]]
        begin = float(trial.record.time[row])
        for k, value in enumerate(force[i][:-1]):
            if abs(value) < PULSE_SURE * strongest:
                continue
            at = begin + segments.KNOT * k
            last = found[-1] if found else None
            joined = (
                last is not None and last["voyage"] == name
                and at - last["end_s"] < 2.5 * segments.KNOT and last["force_N"] * value > 0
            )  # fmt: skip
            if joined:
                assert last is not None
                last["end_s"] = at
                if abs(value) > abs(last["force_N"]):
                    last |= {"force_N": float(value), "sd_N": float(sd[i, k])}
            else:
                found.append(
                    {"voyage": name, "start_s": at, "end_s": at, "force_N": float(value),
                     "sd_N": float(sd[i, k])}
                )  # fmt: skip
    return found


def _made(run: Run, before_effect: bool) -> str:
    if run.config.physical and not run.config.physics.fit:
        return "of coefficients that were not fitted to these voyages"
    return "on voyages before these" if before_effect else "on these very voyages"


def _too_little(run: Run, recorded: Record, before_effect: bool, out: Path) -> Diagnosis:
    short = max(LEAST_S - recorded.seconds, segments.SECONDS * 4 - recorded.seconds, 0.0)
    said = (
        f"Too little for a verdict: {recorded.seconds:.0f} s can be used and {LEAST_S:.0f} s in "
        f"unbroken stretches of {segments.SECONDS:.0f} s are needed. Log at least {short:.0f} s "
        "more, with turns both ways, a stop, and runs on several headings."
    )
    verdict = Verdict("coverage", said, run.name, before_effect)
    done = Diagnosis(verdict, None, None, None, None, None, None, out)
    _write(done)
    return done


def _write(done: Diagnosis) -> None:
    done.folder.mkdir(parents=True, exist_ok=True)
    (done.folder / "report.md").write_text(verdicts.markdown(done.verdict), encoding="utf-8")
    runs.write_json(done.folder / "verdict.json", done.verdict.as_json())


def _save(done: Diagnosis, run: Run, store: Store, names: Sequence[str], began: float) -> None:
    _write(done)
    split = run.config.split.model_copy(update={"training": tuple(names), "validation": ()})
    runs.write_json(done.folder / "provenance.json", provenance(store, split, began))
    if done.recording is not None:
        from pipelines import diagnosis_pictures  # which needs the names above

        diagnosis_pictures.save(done, done.recording)


def _extend(run: Run, done: Diagnosis, out: Path, cause_files: Sequence[Path]) -> None:
    """The named causes as a run of its own; none, and nothing is written."""
    if done.after is None or done.decision is None:
        log.info("nothing was named that a model can take in: %s is not written", out)
        return
    runs.extend(run, out, done.after, cause_files)
    log.info("extended model in %s", out)


def diagnose_command(
    store_path: Path,
    run: Path,
    *,
    voyages: Sequence[str],
    out: Path,
    extend: Path | None,
    cause_files: Sequence[Path],
) -> Answer:
    """`shiplog diagnose`."""
    done = diagnose_run(
        run, Store(store_path), voyages, out, extend=extend, cause_files=cause_files
    )
    text = f"{verdicts.markdown(done.verdict)}\nReport: {out / 'report.md'}"
    content = done.verdict.as_json()
    if done.recording is not None:
        text += f"\nRecording: {done.recording}"
        content["recording"] = str(done.recording)
    if extend is not None and done.after is not None:
        text += f"\nExtended model: {extend}"
    return Answer(text, content)
