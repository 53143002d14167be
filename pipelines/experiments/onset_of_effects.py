"""When hidden effects begin: the truth against the onset that a diagnosis gives.

    python -m pipelines.experiments.onset_of_effects WORK [--cases 64] [--first 0] [--others 0]

Four ships of three families (`simulated_ship`, `other_families`), which share no equation with
shiplog's model. Each is identified once from nominal voyages. Its trials are two short voyages with
one effect of realistic size, which acts from the start, from a random second on, or between two
random seconds. The effect is then known to be named: its own hypothesis is fitted, and asked since
when. What an effect does to instruments begins and ends between two rows of the log.

An effect that its trial cannot show (a log Bayes factor below `thresholds.SHOWS_NATS`) would not be
named, and is counted apart.
"""

from __future__ import annotations

import argparse
import json
import logging
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import polars as pl
from threadpoolctl import threadpool_limits

from pipelines.experiments import other_families
from pipelines.experiments.other_families import cases as others
from pipelines.experiments.other_families import effects as other_effects
from pipelines.experiments.other_families import instruments, profiles
from pipelines.experiments.other_families import voyage as other_voyage
from pipelines.experiments.simulated_ship import cases as own
from pipelines.experiments.simulated_ship import sensors
from pipelines.experiments.simulated_ship import voyage as own_voyage
from shiplog.commands.identify import identify_run
from shiplog.commands.prepare import ingest_logs
from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import as_it_stands, evidence
from shiplog.diagnosis.hypotheses.evaluate import evaluate
from shiplog.diagnosis.noise.remainder import RAISED, Remainder
from shiplog.diagnosis.onset import onsets, stretch_information
from shiplog.diagnosis.trial import setup, trial_voyages
from shiplog.diagnosis.trial.fitted import Fit, Start
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict.result import Named
from shiplog.nomenclature.numbers import figure
from shiplog.training.runs import load_model
from shiplog.training.settings.run_config import Config, Physics
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.rows import recording
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split import choose_physical_split

log = logging.getLogger(__name__)

SHIPS = (("simulated_ship", 7101), ("abkowitz", 21), ("catamaran", 22), ("azimuth_ferry", 23))
# `--others N` adds N to these seeds: ships and weather with which no number of the onset was set.
NOMINAL_S, TRIAL_S = 3400.0, 1800.0
PATTERNS = ("start", "later", "on_off", "later")  # one case after another
NEAR_ENDS_S = 90.0  # a beginning or an end is at least so far from those of the trial
LEFT_OUT = (  # what has a slope or times of its own, is not a cause, or is not felt everywhere
    "fouling", "thrust_drift", "side_thrust", "shallow_water", "bank",
)  # fmt: skip
SENSORS = (
    "heading_offset", "yaw_rate_bias", "yaw_rate_scale", "clock_offset", "antenna_offset",
    "wind_direction_offset", "wind_speed_scale",
)  # fmt: skip
GOALS = ((0.85, 0.95), 0.95)  # of the intervals; of "from the start"


@dataclass(frozen=True)
class Simulator:
    """One ship: how a case of it is drawn, sailed and written."""

    family: str
    seed: int

    @property
    def profile_text(self) -> str | None:
        return None if self.own else profiles.profile(self.case("none", 1.0).ship)

    @property
    def own(self) -> bool:
        return self.family == "simulated_ship"

    @property
    def causes(self) -> tuple[str, ...]:
        known = own.CATALOGUE if self.own else other_families.offered(self.family, self.seed)
        outside = own.OUTSIDE if self.own else other_families.OUTSIDE
        return tuple(n for n in known if n not in outside and n not in LEFT_OUT)

    def case(self, cause: str, size: float) -> Any:
        if self.own:
            return own.draw(self.seed, cause=cause, size=size, seconds=500)
        return others.draw(
            self.seed, family=self.family, cause=cause, size=size, seconds=TRIAL_S,
            nominal_seconds=NOMINAL_S,
        )  # fmt: skip

    def nominal(self, case: Any) -> list[Any]:
        return [one for one in case.nominal if one.name in _own_nominal()] if self.own else [
            *case.nominal
        ]  # fmt: skip

    def sail(self, case: Any, leg: Any, effects: Any, acts: tuple[float, float]) -> Any:
        more = {"laws": case.laws} if self.own else {}
        given = {"seed": leg.seed, "wind": leg.wind, "effects": effects, "campaign": leg.campaign}
        if self.own:
            return own_voyage.sail(leg.seconds, ship=case.ship, acts=acts, **given, **more)
        return other_voyage.sail(case.ship, leg.seconds, acts=acts, **given)

    def nothing(self, case: Any) -> Any:
        return case.ordinary if self.own else other_effects.Effects()

    @property
    def writer(self) -> ModuleType:
        return sensors if self.own else instruments


def _own_nominal() -> tuple[str, ...]:
    return ("nominal_1", "nominal_3", "nominal_5", "nominal_6")


@dataclass(frozen=True)
class Ship:
    """A simulator with its identified model, and a trial that others are made like."""

    of: Simulator
    run: load_model.Run
    nominal: Record
    like: Trial
    work: Path


def prepare(of: Simulator, work: Path) -> Ship:
    """Nominal voyages sailed, ingested and fitted; what is there already is kept."""
    folder = work / f"{of.family}-{of.seed}"
    logs = folder / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    profile = "esso-vectwin"
    if (text := of.profile_text) is not None:
        (folder / "ship.toml").write_text(text, encoding="utf-8")
        profile = str(folder / "ship.toml")
    case = of.case("none", 1.0)
    store = Store(folder / "store")
    paths = []
    for leg in of.nominal(case):
        path = logs / f"{leg.name}.mcap"
        if not path.exists():
            sailed = of.sail(case, leg, of.nothing(case), (0.0, np.inf))
            of.writer.write_voyage(path, sailed, seed=leg.seed, start=leg.start)
        paths.append(path)
    ingest_logs(paths, profile, store)
    if not (folder / "mmg").exists():
        split = choose_physical_split(store, ("nominal_*",), (), "ref", 100)
        identify_run(Config(model="mmg", split=split, physics=Physics(folds=2)), store,
                     folder / "mmg")  # fmt: skip
    run = load_model.load(folder / "mmg")
    names = store.there(run.trained_on)
    ship_profile = store.profile(names)
    nominal = trial_voyages.record_of(store, names, ship_profile)
    nominal, other = trial_voyages.rescale_time(run, nominal, nominal)
    assert nominal is not None
    return Ship(of, run, nominal, setup.trial_of(run, nominal, other, ()).trial, folder)


@dataclass(frozen=True)
class Truth:
    """What is hidden in a case, and from when to when of the recorded time [s]."""

    ship: str
    cause: str
    pattern: str
    begin: float
    end: float


def truths(ships: Sequence[Simulator], count: int) -> Iterable[tuple[Simulator, Truth]]:
    """Ships in turn, causes in turn, patterns in turn; times at random."""
    for number in range(count):
        of = ships[number % len(ships)]
        place = number // len(ships)
        cause = of.causes[place % len(of.causes)]
        pattern = PATTERNS[(place + number) % len(PATTERNS)]
        rng = np.random.default_rng([number, zlib.crc32(cause.encode())])
        begin, end = 0.0, TRIAL_S
        if pattern == "later":
            begin = float(rng.uniform(NEAR_ENDS_S, TRIAL_S - 3.0 * NEAR_ENDS_S))
        if pattern == "on_off":
            begin, end = np.sort(rng.uniform(NEAR_ENDS_S, TRIAL_S - NEAR_ENDS_S, 2))
            if end - begin < 4.0 * NEAR_ENDS_S:
                middle = np.clip(0.5 * (begin + end), 3.0 * NEAR_ENDS_S, TRIAL_S - 3 * NEAR_ENDS_S)
                begin, end = middle - 2.0 * NEAR_ENDS_S, middle + 2.0 * NEAR_ENDS_S
        yield of, Truth(of.family, cause, pattern, round(float(begin), 1), round(float(end), 1))


def record_of(ship: Ship, truth: Truth, number: int) -> tuple[Record, str]:
    """The trial's record, and the label of what is hidden."""
    of = ship.of
    case = of.case(truth.cause, 1.0)
    legs = [replace(leg, seconds=0.5 * TRIAL_S) for leg in case.trial] if of.own else case.trial
    tables, names, passed = [], [], 0.0
    for leg in legs:
        leg = replace(leg, seed=leg.seed + number)
        acts = (truth.begin - passed, truth.end - passed)
        label = truth.cause.partition(":")[0]
        of_sensor = label in SENSORS
        # a voyage is sailed with what acts on the ship, and logged by instruments in two states
        sailed = of.sail(case, leg, of.nothing(case) if of_sensor else case.effects, acts)
        tables.append(_logged(ship, case, leg, sailed, acts if of_sensor else None, number))
        names.append(leg.name)
        passed += leg.seconds
    read = recording.read(tables, names, ship.nominal.profile)
    return replace(read, timescale=ship.nominal.timescale), _label(case, truth)


def _logged(
    ship: Ship, case: Any, leg: Any, sailed: Any, acts: tuple[float, float] | None, number: int
) -> pl.DataFrame:  # fmt: skip
    """The 10 Hz table of a voyage. Of a sensor's effect that acts for a time, its rows are those of
    a log with it, and the others those of one without."""
    path = ship.work / f"trial_{number}.mcap"

    def table(effects: Any) -> pl.DataFrame:
        one = replace(sailed, effects=effects)
        ship.of.writer.write_voyage(path, one, seed=leg.seed, start=leg.start)
        found = ingest(path, ship.nominal.profile).table
        path.unlink()
        return found

    if acts is None:
        return table(sailed.effects)
    without, with_it = table(ship.of.nothing(case)), table(case.effects)
    began = without["time"][0]
    seconds = (pl.col("time") - began).dt.total_microseconds() * 1e-6
    inside = (seconds >= acts[0]) & (seconds < acts[1])
    both = pl.concat([without.filter(~inside), with_it.filter(inside)])
    return both.sort("time")


def _label(case: Any, truth: Truth) -> str:
    name = truth.cause.partition(":")[0]
    if name == "clock_offset":
        return f"{name}:{case.causes[0].parameters['channel']['value']}"
    return name


def fitted(ship: Ship, record: Record, label: str) -> tuple[Trial, Fit, float]:
    """The hypothesis of this cause alone, with raised noise, and its log Bayes factor over none."""
    made = Trial.build(ship.like.campaign, record)
    trial, point = as_it_stands.begin(made, {})
    remainder = Remainder(RAISED)
    cause = next(c for c in trial.reference.model.causes if c.label == label)
    nothing, (first,) = evidence.scan(trial, point, [cause], remainder=remainder)
    start = Start(first.numbers, point.path, first.noise_factor)
    fit = evaluate(trial, (label,), remainder, start)
    return trial, fit, fit.estimate.evidence - nothing.evidence


def answer(ship: Ship, truth: Truth, number: int) -> dict[str, Any]:
    """One case: truth and onset."""
    record, label = record_of(ship, truth, number)
    trial, fit, nats = fitted(ship, record, label)
    of = {"ship": truth.ship, "cause": label, "pattern": truth.pattern, "begin": truth.begin,
          "end": truth.end, "nats": nats, "segment_s": trial.grid.seconds,
          "noise": fit.estimate.noise_factor}  # fmt: skip
    if fit.diverged or nats < thresholds.SHOWS_NATS:
        return of | {"shown": False}
    cause = next(c for c in trial.reference.model.causes if c.label == label)
    covariance = fit.estimate.covariance
    assert covariance is not None
    one = Named(cause, nats, 1.0, np.asarray(fit.estimate.numbers[label]), covariance)
    information = stretch_information.of_cause(trial, fit, label)
    found = onsets.onset(trial, information, one)
    off = found.off
    return of | {
        "shown": True, "found": found.begin.elapsed_s, "low": found.begin.low,
        "high": found.begin.high, "from_start": found.from_start, "ends": found.ends,
        "off": None if off is None else [off.elapsed_s, off.low, off.high],
        "acting": [round(float(p), 4) for p in found.acting],
        "edges": [round(float(at), 1) for at in found.edges],
    }  # fmt: skip


def summary(cases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Coverage of intervals, median errors in segments, and how often "from the start" is right."""
    shown = [one for one in cases if one["shown"]]
    later = [one for one in shown if one["pattern"] != "start"]
    held = [one["low"] <= one["begin"] <= one["high"] for one in later]
    error = [abs(one["found"] - one["begin"]) / one["segment_s"] for one in later]
    right = [(one["from_start"] >= 0.5) == (one["pattern"] == "start") for one in shown]
    on_off = [one for one in shown if one["pattern"] == "on_off"]
    stopped = [one for one in on_off if one["off"]]
    off_held = [one["off"][1] <= one["end"] <= one["off"][2] for one in stopped]
    false_off = [one for one in shown if one["pattern"] != "on_off" and one["off"]]
    off_error = [abs(one["off"][0] - one["end"]) / one["segment_s"] for one in stopped]
    return {
        "cases": len(cases), "shown": len(shown), "later": len(later), "held": sum(held),
        "error_segments": float(np.median(error)) if error else None,
        "start_right": sum(right), "on_off": len(on_off), "off_found": len(stopped),
        "off_held": sum(off_held), "off_false": len(false_off),
        "off_error_segments": float(np.median(off_error)) if off_error else None,
    }  # fmt: skip


def table(cases: Sequence[Mapping[str, Any]]) -> str:
    """A row a pattern and one of all, in Markdown."""
    head = ("pattern", "cases", "shown", "interval holds the beginning", "median error [segments]",
            '"from the start" right', "end found", "interval holds the end")  # fmt: skip
    lines = [f"| {' | '.join(head)} |", f"| --- |{' ---: |' * (len(head) - 1)}"]
    for pattern in ("start", "later", "on_off", "all"):
        own = [one for one in cases if pattern in ("all", one["pattern"])]
        of = summary(own)
        error = "-" if of["error_segments"] is None else figure(of["error_segments"], 2)
        cells = (
            pattern.replace("_", " and "), of["cases"], of["shown"], f"{of['held']}/{of['later']}",
            error, f"{of['start_right']}/{of['shown']}", f"{of['off_found']}/{of['on_off']}",
            f"{of['off_held']}/{of['off_found']}",
        )  # fmt: skip
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m pipelines.experiments.onset_of_effects", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("work", type=Path, help="a folder for ships and answers")
    parser.add_argument("--cases", type=int, default=64, help="the last one is below this")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--others", type=int, default=0, help="other ships: added to their seeds")
    given = parser.parse_args(arguments)
    simulators = [Simulator(family, seed + given.others) for family, seed in SHIPS]
    ships: dict[Simulator, Ship] = {}
    given.work.mkdir(parents=True, exist_ok=True)
    answers = given.work / f"answers-{given.first}.jsonl"
    done = len(answers.read_text(encoding="utf-8").splitlines()) if answers.exists() else 0
    with threadpool_limits(limits=1, user_api="blas"):
        for number, (of, truth) in enumerate(truths(simulators, given.cases)):
            if number < given.first + done:
                continue
            if of not in ships:
                ships[of] = prepare(of, given.work)
            found = answer(ships[of], truth, number)
            print(json.dumps(found), flush=True)
            with answers.open("a", encoding="utf-8") as file:
                file.write(json.dumps(found) + "\n")
    every = [json.loads(line) for path in sorted(given.work.glob("answers-*.jsonl"))
             for line in path.read_text(encoding="utf-8").splitlines()]  # fmt: skip
    print(table(every))


if __name__ == "__main__":
    main()
