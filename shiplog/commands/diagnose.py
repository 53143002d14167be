"""A model and voyages to a verdict: what is wrong, why, the extended model, the gain."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from shiplog.commands.bars import reach, staged
from shiplog.diagnosis.decision_parts import ALL, Parts
from shiplog.diagnosis.linear import segments
from shiplog.diagnosis.onset import onsets
from shiplog.diagnosis.residual import error_location
from shiplog.diagnosis.season import trends
from shiplog.diagnosis.trial import trial_voyages
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict import (
    baseline_check,
    contradicted_causes,
    exchanged_twins,
    excluded_causes,
    network_base,
    sign_conventions,
    trial_decision,
)
from shiplog.diagnosis.verdict import result as decisions
from shiplog.diagnosis.verdict.held_out import HeldOut
from shiplog.exceptions import ShiplogError
from shiplog.machine import files
from shiplog.machine.paths import check_diagnosis, refuse_other_answer
from shiplog.machine.unexpected import unexpected
from shiplog.models.causes import Cause, user
from shiplog.report import viewer
from shiplog.report.diagnosis import answer, diagnosis_pictures, page, picture_tables
from shiplog.report.diagnosis.answer import Context
from shiplog.report.diagnosis.diagnosis import PAGE, RECORDING, Diagnosis
from shiplog.report.diagnosis.sections import subject
from shiplog.report.figures import picture_data, voyage_tables
from shiplog.report.figures.plots import Plots
from shiplog.report.page import html
from shiplog.report.page.diagnosis import page as diagnosis_page
from shiplog.report.page.diagnosis import source as sources
from shiplog.report.page.diagnosis.source import PROVENANCE, VERDICT
from shiplog.report.result import Shown
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.extended_simulator import ExtendedSimulator
from shiplog.training.runs import extension_file, load_model
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.provenance import portable, provenance
from shiplog.training.runs.run_checks import refuse_other_ship
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store import contradicted, parts, voyage_starts
from shiplog.voyages.store.contradicted import Contradicted
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.windows import Windows

log = logging.getLogger(__name__)

NOMINAL = 8  # segments: fewer give no nominal campaign


# seconds of the sample logs' second season
STAGES = {
    "nominal voyages": 60.0, "hypotheses": 30.0, "held-out voyages": 10.0, "external forces": 5.0,
    "report": 10.0,
}  # fmt: skip


@staged("diagnosing", STAGES)
@threadpool_limits.wrap(limits=1, user_api="blas")  # of matrices too small to share out
def diagnose_run(
    run_path: Path,
    store: Store,
    voyages: Sequence[str],
    out: Path,
    *,
    extend: Path | None = None,
    cause_files: Sequence[Path] = (),
    switches: Parts = ALL,
    ray: str | None = None,
    simulators: Sequence[str] = (),
) -> Diagnosis:
    """The whole way; the `switches` say which parts of the decision act. Raises ShiplogError.

    ray         address of a Ray cluster that holds the segments and adds up their products; the
                numbers are the same
    simulators  files of simulators of the user's own: the run may be one of these
    """
    if ray is None:
        return _run(
            run_path, store, voyages, out, extend, cause_files, switches, simulators=simulators
        )
    from shiplog.commands import cluster_trials  # what a diagnosis in one process does without

    with cluster_trials.on_cluster(ray) as share:
        return _run(run_path, store, voyages, out, extend, cause_files, switches, share, simulators)


def _run(
    run_path: Path,
    store: Store,
    voyages: Sequence[str],
    out: Path,
    extend: Path | None,
    cause_files: Sequence[Path],
    switches: Parts,
    share: Callable[[Trial], Trial] = lambda trial: trial,
    simulators: Sequence[str] = (),
) -> Diagnosis:
    began = time.time()
    check_diagnosis(out, extend)
    causes = user.load(cause_files)
    run = load_model.load(run_path, causes, simulators)
    names = trial_voyages.voyages_of(run, store, voyages)
    profile = store.profile(names)
    refuse_other_ship(run, profile)
    hashes = store.hashes(names)
    refuse_other_answer(out, run.name, hashes)
    recorded = trial_voyages.record_of(store, names, profile)
    before_effect = not parts.overlapping(names, run.trained_on) and not run.given
    nominal = _nominal(run, store, profile) if before_effect else None
    if switches.time_scale:
        nominal, recorded = trial_voyages.rescale_time(run, nominal, recorded)
    used = [*names, *store.there(run.trained_on)]
    against = contradicted.list_contradicted(store, dict.fromkeys(used))
    if contradicted.everywhere(against):
        done = Diagnosis(answer.contradicted(run, recorded, before_effect, against), out)
    elif answer.enough(recorded):
        if nominal is not None and len(segments.begins(nominal)) < NOMINAL:
            nominal = None
        campaign = Campaigns(
            run, store, names, profile, recorded, nominal, before_effect, against, switches, share
        )
        done = _decided(campaign, out, causes)
    else:
        done = Diagnosis(answer.too_little(run, recorded, before_effect), out)
    seconds = voyage_tables.Seconds.of(store, names, profile)
    about = subject.of(run, done.verdict.made, profile, seconds.voyages)
    done = replace(done, verdict=replace(done.verdict, subject=about))
    _save(done, hashes, began, {"run_path": run_path, "store_path": store.path})
    datums = {name: found for name in names if (found := store.origin(name)[1]) is not None}
    done = _drawn(replace(done, datums=datums), run, seconds)
    if extend is None:
        return done
    if done.after is None:
        log.info("no named cause can be part of a model: %s is not written", extend)
        return done
    # last: once it is there, the same command is refused
    extended = _extended(run, done.after, extend, cause_files, causes, simulators)
    return replace(done, extended=extended)


@dataclass(frozen=True)
class Campaigns:
    """A run and the trial voyages; `nominal` is None where its training voyages are not stored.

    before_effect   whether the run was trained on other voyages than these
    against         short stretches that contradict themselves
    share           gives a trial's voyages to others, who hold them
    """

    run: Run
    store: Store
    names: Sequence[str]
    profile: Profile
    recorded: Record
    nominal: Record | None
    before_effect: bool
    against: Sequence[Contradicted] = ()
    switches: Parts = ALL
    share: Callable[[Trial], Trial] = lambda trial: trial


def _decided(of: Campaigns, out: Path, causes: Sequence[Cause]) -> Diagnosis:
    """What was found; where no path of the model can be computed, that it diverges."""
    try:
        return _diagnosed(of, out, causes)
    except np.linalg.LinAlgError as error:  # of a matrix that only a model out of reach makes
        detailed = log.isEnabledFor(logging.DEBUG)
        log.info("no path of the model can be computed: %s", error, exc_info=detailed)
        return Diagnosis(answer.runs_away(of.run, of.recorded, of.before_effect), out)


def _diagnosed(of: Campaigns, out: Path, causes: Sequence[Cause]) -> Diagnosis:
    run, store, names, profile = of.run, of.store, of.names, of.profile
    recorded, nominal, before_effect = of.recorded, of.nominal, of.before_effect
    notes = answer.read_otherwise(run, profile)
    if before_effect and nominal is None:
        notes.append(answer.without_nominal(run, store.path))
    if run.given:
        notes.append(answer.of_given(run))
    notes += run.notes
    cut = trial_voyages.windows_of(run, store, names, profile)
    before = _nominal_windows(of) if nominal is not None else None
    if cut is not None and before is not None:
        simulator = run.extended(run.config.seeds[0], recorded)
        if why := sign_conventions.sufficient_convention(simulator, cut, before, profile):
            return Diagnosis(
                answer.other_convention(run, recorded, before_effect, why, of.against, notes), out
            )
    lacking = run.lacks
    if nominal is not None:
        lacking = baseline_check.lacking(run, store, profile) if of.switches.baseline else ""
    barred = contradicted_causes.barred_causes(contradicted.channels(of.against), profile)
    decided = trial_decision.decide_trial(
        run, nominal, recorded, cut, causes, lacking, reach, barred, before, profile, of.switches,
        of.share, _excluded(of),
    )  # fmt: skip
    tried, judge = decided.trial, decided.judge
    decision, found, dropped = decided.decision, decided.gain, dict(decided.refuted)
    untested = dict(decided.untested)
    notes += [lacking] if lacking else []
    whole = tried.covering(decided.point)
    reach("external forces")
    external, out_of_reach = error_location.find_external_forces(
        tried, decided.point, whole, decision.fit.remainder, nominal
    )
    tried = tried.leave_out(out_of_reach)
    judge = None if judge is None else replace(judge, trial=tried)
    held, network, alone = judge, None, None
    if not run.judges_itself:
        notes += answer.of_physics(run, tried, found)
        network = network_base.Own(run, tried)
        if cut is not None:
            own = run.extended(run.config.seeds[0], recorded)
            held = HeldOut(cut, own, tried, network, before, profile)
            decision, found = held.simulated_with(decision)
    lost = held.lost(found, {n.cause.name for n in decision.named}) if held else ""
    if not lost and decision.verdict in answer.OPEN:
        numbers = run.extension_numbers()
        lost = exchanged_twins.explains(tried, decided.point, decision, numbers, profile)
    if lost:
        dropped |= {n.cause.label: answer.none_named(lost) for n in decision.named}
        decision, found = decisions.without_simulation(decision), None
    elif held and decision.verdict in answer.OPEN and held.hint:
        notes.append(held.hint)
    starts = voyage_starts.dated(store, names)
    courses = onsets.of_decision(tried, decision, starts)
    seasons = trends.of_verdict(tried, decision.fit, decision.named, starts)
    simulated = (tried, decision)
    if network is not None:
        simulated = network.extended_by(decision)
        whole = simulated[0].covering(simulated[1].nothing.point)
    if held and decision.named and tried.reference.adapts:
        notes += answer.of_own_voyages(run, tried, decision)
        alone = held.adapted(decision).reduction if decision.adapted else None
    reach("report")
    context = Context(
        run,
        before_effect and nominal is not None,
        untested,
        dropped,
        lost,
        notes,
        external,
        tried.grid.seconds,
        error_location.uncovered_windows(run, store, names, profile, held.cut) if held else (),
        error_location.errors_by_channel(held) if held else (),
        error_location.find_omitted_inputs(simulated[0], simulated[1].nothing, whole),
        alone,
        of.against,
        courses,
        seasons,
    )
    after = held.extended(decision) if held and decision.named else None
    verdict = answer.verdict(tried, decision, found, held, context)
    return Diagnosis(
        verdict, out, decision, tried, simulated, whole, held, after, courses=courses
    )  # fmt: skip


def _excluded(of: Campaigns) -> dict[str, str]:
    """Label of a cause → how the sensors of the trial, and of the nominal voyages, exclude it."""
    nominal = of.store.there(of.run.trained_on) if of.nominal is not None else []
    tables = [
        {name: table.collect() for name, table in zip(names, of.store.tables(names), strict=True)}
        for names in (of.names, nominal)
    ]
    return excluded_causes.excluded_causes(tables, of.profile)


def _nominal(run: Run, store: Store, profile: Profile) -> Record | None:
    """The training voyages of the run; None where the store does not have them."""
    there = store.there(run.trained_on)
    if not there:
        return None
    return trial_voyages.record_of(store, there, profile)


def _nominal_windows(of: Campaigns) -> Windows | None:
    """Those that the run was trained on, as the store has them."""
    there = of.store.there(of.run.trained_on)
    return trial_voyages.windows_of(of.run, of.store, there, of.profile)


def _save(
    done: Diagnosis, hashes: Mapping[str, str | None], began: float, places: Mapping[str, Path]
) -> None:
    """Report, verdict and provenance; pictures of an earlier diagnosis do not stay."""
    done.folder.mkdir(parents=True, exist_ok=True)
    files.write_text(done.markdown, page.written(done.verdict))
    files.write_json(done.folder / VERDICT, done.verdict.as_json())
    for name in (RECORDING, PAGE, sources.GATE):
        files.remove(done.folder / name)
    portable_places = {key: portable([str(path)])[0] for key, path in places.items()}
    facts = provenance(hashes, began) | portable_places
    files.write_json(done.folder / PROVENANCE, facts)


def _extended(
    run: Run, after: ExtendedSimulator, out: Path, own: Sequence[Path], causes: Sequence[Cause],
    simulators: Sequence[str],
) -> Run:  # fmt: skip
    """The model with the named causes, as the run `out`."""
    return load_model.load(extension_file.extend(run, out, after, own), causes, simulators)


def _drawn(done: Diagnosis, run: Run, seconds: voyage_tables.Seconds) -> Diagnosis:
    """The pictures and the page, once the verdict is written. Where they fail, the answer says
    why."""
    try:
        exhibit = None if done.decision is None else diagnosis_pictures.exhibit(done)
        data = picture_tables.of_diagnosis(done, exhibit, run, seconds)
        picture_data.save(data, done.folder / picture_data.FOLDER)
        if exhibit is not None:
            viewer.save_diagnosis(exhibit, done.folder / RECORDING)
        source = sources.read(done.folder)
        html.write(diagnosis_page.of_source(source), done.folder / PAGE)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # a panic of polars is no Exception
        fault = error if isinstance(error, ShiplogError) else unexpected(error, "drawing")
        log.warning("%s", fault)
        return replace(done, drawn=False)
    shown = Shown(
        lambda: Plots(source.content), lambda: html.render(diagnosis_page.of_source(source))
    )
    return replace(done, shown=shown)
