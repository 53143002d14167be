"""The main job on the sample logs, from MCAP to a verdict: what a new user sees first."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from shiplog.commands.compare import compare_runs
from shiplog.commands.diagnose import diagnose_run
from shiplog.commands.identify import identify_run
from shiplog.commands.prepare import ingest_logs
from shiplog.commands.train_networks import train_run
from shiplog.exceptions import listed
from shiplog.machine.paths import refuse_no_season, refuse_none_ingested, sample_logs
from shiplog.report import viewer
from shiplog.report.diagnosis.diagnosis import PAGE
from shiplog.report.evaluation import tables
from shiplog.report.result import Printed
from shiplog.training.runs import run_folder
from shiplog.training.runs.run_checks import refuse_other_rows
from shiplog.training.settings.run_config import Config, Fast, Physics
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split import choose_physical_split, choose_split

log = logging.getLogger(__name__)

DATASETS = ("ref", "d-ref")  # the paper's two voyages, and four that met the test's wind
SEEDS = (0, 1, 2)
NEXT_SEASON = "season2_*"  # the ship half a year later, with something hidden in its logs
RECIPE = Fast(iterations=200)  # a hundred fewer than by default: somebody waits for a demo


@dataclass(frozen=True, repr=False)
class Demo(Printed):
    """What the demo says and where the recording is.

    complete   whether every log was taken, every message of it could be read, and all that the
               demo makes could be written
    """

    lines: Sequence[str]
    json: dict
    recording: Path
    complete: bool = True


def run_demo(out: Path, logs: Path | None) -> Demo:
    """Ingest, train, compare, diagnose, extend, gain. Resumes: what is in `out` already is not
    done again."""
    began = time.monotonic()
    folder = sample_logs(logs)
    store = Store(out / "store")
    log.info("1/4 ingesting %s", folder)
    done = ingest_logs(sorted(folder.glob("*.mcap")), None, store)
    for refused, why in done.refused.items():
        log.warning("%s refused: %s", Path(refused).name, why)
    for line in (line for report in done.damaged for line in tables.voyage_lines(report)):
        log.warning("%s", line)
    refuse_none_ingested(done.reports, folder)
    refuse_no_season(store.select(), NEXT_SEASON, folder)
    paths = []
    for data in DATASETS:
        path = out / "runs" / data
        paths.append(path)
        if _trained_already(path, store):
            continue
        split = choose_split(store, (), (), data, 100)
        training, validation = listed(split.training), listed(split.validation)
        log.info("2/4 training on %s: %s, validating on %s", data, training, validation)
        train_run(Config(data=data, seeds=SEEDS, split=split, fast=RECIPE), store, path)
    path = out / "runs" / "mmg"
    if not _trained_already(path, store):
        split = choose_physical_split(store, (), (), DATASETS[0], 100)
        log.info("2/4 identifying mmg on %s", listed(split.training))
        config = Config(model="mmg", data=DATASETS[0], split=split, physics=Physics(folds=2))
        identify_run(config, store, path)
    paths.append(path)
    log.info("3/4 comparing on the test voyage")
    result = compare_runs(paths, store, (), out / "compare.rrd")
    log.info("4/4 diagnosing mmg on %s: what is wrong half a year later?", NEXT_SEASON)
    extended = out / "runs" / "mmg-extended"
    diagnosis = diagnose_run(
        path, store, [NEXT_SEASON], out / "diagnosis",
        extend=None if extended.exists() else extended,
    )  # fmt: skip
    both, repeated, drawn = [path], "nothing was named", diagnosis.drawn
    content = result.json | {"diagnosis": diagnosis.verdict.as_json()}
    if extended.exists():
        both.append(extended)
        again = diagnose_run(extended, store, [NEXT_SEASON], out / "diagnosis-again")
        repeated, content["diagnosis_again"] = again.verdict.sentence, again.verdict.as_json()
        drawn = drawn and again.drawn
    season = compare_runs(both, store, [NEXT_SEASON], out / "season2.rrd")
    took = time.monotonic() - began
    page = out / "diagnosis" / PAGE
    where = f"The page to look at first, and to mail: {page}" if page.is_file() else "No page."
    ending = (
        f"\nHalf a year later ({NEXT_SEASON}), the same ship:\n\n"
        f"{diagnosis.verdict.sentence}\n\nThe extended model, diagnosed again: {repeated}\n\n"
        f"Took {took:.0f} s. The voyages are in {store.path}, the runs in {out / 'runs'}, the "
        f"diagnosis in {out / 'diagnosis' / 'report.md'}.\n"
        f"{where}\n"
        f"Look at the voyages again: {viewer.RERUN} {result.written()} {season.written()}\n"
        "The store has two more seasons, season3_* and season4_*: "
        f"shiplog diagnose {path} --voyages 'season3_*' --store {store.path}"
    )
    content |= {"season2_recording": str(season.written()), "seconds": round(took, 1)}
    content |= {"refused": {path: str(why) for path, why in done.refused.items()}}
    complete = done.complete and drawn and not (result.lost or season.lost)
    return Demo((*result.lines, ending), content, result.written(), complete)


def _trained_already(path: Path, store: Store) -> bool:
    """Whether there is such a run. Raises RunError where it is of other rows than the store's."""
    if not path.exists():
        return False
    refuse_other_rows(run_folder.open_finished(path), store)
    log.info("2/4 %s is trained already", path)
    return True
