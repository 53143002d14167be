"""Recorded voyages replayed as live: each alarm and health message with its second, next to what
`ingest` and `diagnose` say of the same voyage.

    python -m pipelines.experiments.watching.replayed RUN STORE LOGS OUT.jsonl --per-day 24
    python -m pipelines.experiments.watching.replayed RUN STORE LOGS OUT.jsonl --report \
        [--verdict verdict.json] [--markdown docs/evidence/watched_voyages.md]

One line a voyage is appended to OUT.jsonl; what is there is not done again. Every voyage is watched
from its first message on, without what was learned from the one before. No truth is assumed.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from pipelines.experiments.watching.false_alarms import done, resident_mb
from shiplog.live import nominal, preparation, sources
from shiplog.live.alarm import Alarm
from shiplog.live.error_now import Point
from shiplog.live.events import SegmentDone, sentence
from shiplog.live.health import Notice
from shiplog.live.session import Watch
from shiplog.nomenclature.units import SECOND_NS
from shiplog.training.runs import load_model
from shiplog.voyages.samples import fields_read
from shiplog.voyages.store.store import Store

TITLE = """# Recorded voyages, watched

Voyages of the 3 m Esso Osaka (`frt-ds-esso`) replayed as if they were sailed now, each from its
first message on. What the watch says stands next to what `ingest` says of the same log, and
`diagnose` of all of them with the published coefficients. No truth is assumed. A value that repeats
for less than three seconds is reported by `ingest` alone, and so are clocks and scales, which need
a whole log.
Written by `python -m pipelines.experiments.watching.replayed RUN STORE LOGS OUT.jsonl --report`.
"""


def watch_all(given: argparse.Namespace) -> None:
    run, store = load_model.load(given.run), Store(given.store)
    if why := nominal.why_none(run, store):
        raise SystemExit(f"no alarm with this run: {why}")
    prepared = preparation.campaign_of(run, given.run, store)
    assert prepared is not None
    campaign, calibration = prepared
    before = {one["voyage"] for one in done(given.out)}
    with given.out.open("a", encoding="utf-8") as stream:
        for path in sorted(given.logs.glob("*.mcap")):
            if path.stem in before:
                continue
            source = sources.opened(str(path), fields_read.wanted(run.profile, {}), None)
            watch = Watch(run, source, campaign, calibration, calibration.watcher(given.per_day))
            trained = path.stem in run.trained_on
            line = {"voyage": path.stem, "trained": trained} | replayed(watch)
            source.close()
            stream.write(json.dumps(line) + "\n")
            stream.flush()


def replayed(watch: Watch) -> dict[str, Any]:
    """What a watch says until its source ends, in seconds since the first row."""
    began, statistics, points, said = time.process_time(), [], [], []
    while not watch.done:
        for event in watch.step(time.time_ns()):
            if isinstance(event, SegmentDone):
                statistics.append(event.statistic)
            elif isinstance(event, Point) and event.inside is not None and not event.provisional:
                points.append(event.inside)
            elif isinstance(event, Alarm):
                said.append((event.time, "alarm", sentence(event)))
            elif isinstance(event, Notice):
                said.append((event.time, event.what, event.sentence))
    first = watch.rows.anchor or 0
    lasted = ((watch.rows.done or first) - first) / SECOND_NS
    assert watch.watcher is not None
    return {
        "seconds": lasted, "segments": len(statistics), "most_nats": max(statistics, default=None),
        "threshold": watch.watcher.thresholds.change,
        "inside": sum(points) / len(points) if points else None,
        "said": [
            {"second": round((at - first) / SECOND_NS, 1), "what": what, "sentence": words}
            for at, what, words in said
        ],
        "cpu_s": time.process_time() - began, "resident_mb": resident_mb(),
    }  # fmt: skip


def ingested(store: Path, voyage: str) -> list[str]:
    """What `ingest` says of a voyage: rows that it left out, and other findings."""
    path = store / f"voyage={voyage}" / "voyage.json"
    if not path.exists():
        return ["not in the store"]
    facts = json.loads(path.read_text(encoding="utf-8"))
    report = facts["report"]
    found = [*report.get("left_out", []), *report.get("findings", [])]
    return [str(one.get("sentence") or one) if isinstance(one, dict) else str(one) for one in found]


def diagnosed(verdict: Any, voyage: str) -> list[str]:
    """What a verdict dates to this voyage."""
    if isinstance(verdict, list):
        return [one for of in verdict for one in diagnosed(of, voyage)]
    if not isinstance(verdict, dict):
        return []
    if verdict.get("voyage") == voyage and verdict.get("sentence"):
        return [f"{verdict['start_s']:.0f} to {verdict['end_s']:.0f} s: {verdict['sentence']}"]
    return [one for of in verdict.values() for one in diagnosed(of, voyage)]


def report(given: argparse.Namespace) -> Iterator[str]:
    """The page."""
    lines = done(given.out)
    verdict = None if given.verdict is None else json.loads(given.verdict.read_text("utf-8"))
    whole, cpu = sum(one["seconds"] for one in lines), sum(one["cpu_s"] for one in lines)
    alarms = [
        w for one in lines for w in one["said"]
        if w["what"] == "alarm" and not w["sentence"].startswith("Still")
    ]  # fmt: skip
    yield TITLE
    yield (
        f"{len(lines)} voyages of {whole / 3600.0:.2f} h at {given.per_day:g} false alarms a day, "
        f"of which {whole / 86_400.0 * given.per_day:.1f} are expected: {len(alarms)} alarms. The "
        f"threshold is {lines[0]['threshold']:.1f} nats. They took {cpu:.0f} s of processor time, "
        f"{whole / max(cpu, 1e-9):.0f} times real time; memory at the end "
        f"{lines[-1]['resident_mb']:.0f} MB.\n"
    )
    yield "| voyage | trained on | s | segments | most [nats] | inside the band [%] | said |"
    yield "| --- | --- | ---: | ---: | ---: | ---: | ---: |"
    for one in lines:
        most = "-" if one["most_nats"] is None else f"{one['most_nats']:.1f}"
        inside = "-" if one["inside"] is None else f"{100.0 * one['inside']:.0f}"
        yield (
            f"| {one['voyage']} | {'yes' if one['trained'] else 'no'} | {one['seconds']:.0f} | "
            f"{one['segments']} | {most} | {inside} | {len(one['said'])} |"
        )
    yield "\n## What is said of each\n"
    yield "| voyage | by | at s | sentence |"
    yield "| --- | --- | ---: | --- |"
    for one in lines:
        for word in one["said"]:
            yield (
                f"| {one['voyage']} | watch, {word['what']} | {word['second']:.1f} | "
                f"{word['sentence']} |"
            )
        for by, sentences in (
            ("ingest", [" ".join(ingested(given.store, one["voyage"])) or "nothing"]),
            ("diagnose", list(dict.fromkeys(diagnosed(verdict, one["voyage"])))),
        ):
            for words in sentences:
                yield f"| {one['voyage']} | {by} | | {words} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("run", "store", "logs", "out"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--per-day", type=float, default=24.0)
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--verdict", type=Path)
    parser.add_argument("--markdown", type=Path)
    given = parser.parse_args()
    if not given.report:
        with threadpool_limits(1, user_api="blas"):
            watch_all(given)
    text = "\n".join(report(given)) + "\n"
    if given.markdown is None:
        print(text)
    else:
        given.markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
