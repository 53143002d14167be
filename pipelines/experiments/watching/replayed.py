"""Recorded voyages replayed as live: each alarm and health message with its second, next to what
`ingest` and `diagnose` say of the same voyage.

    python -m pipelines.experiments.watching.replayed RUN STORE LOGS OUT.jsonl --per-day 24
    python -m pipelines.experiments.watching.replayed RUN STORE LOGS OUT.jsonl --report \
        [--verdict verdict.json] [--markdown PAGE]

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

HEAD = (
    "voyage", "trained on", "s", "segments", "most [nats]", "inside [%]", "at s", "watch", "ingest",
    "diagnose",
)  # fmt: skip


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
    facts = json.loads((store / f"voyage={voyage}" / "voyage.json").read_text(encoding="utf-8"))
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
    lines = done(given.out)
    verdict = None if given.verdict is None else json.loads(given.verdict.read_text("utf-8"))
    whole, cpu = sum(one["seconds"] for one in lines), sum(one["cpu_s"] for one in lines)
    yield (
        f"{len(lines)} voyages, {whole / 3600.0:.2f} h, replayed in {cpu:.0f} s of processor time, "
        f"{whole / max(cpu, 1e-9):.0f} times real time; the threshold is "
        f"{lines[0]['threshold']:.1f} nats."
    )
    yield ""
    yield f"| {' | '.join(HEAD)} |"
    yield "| --- | --- | ---: | ---: | ---: | ---: | ---: | --- | --- | --- |"
    for one in lines:
        most = "-" if one["most_nats"] is None else f"{one['most_nats']:.1f}"
        inside = "-" if one["inside"] is None else f"{100.0 * one['inside']:.0f}"
        there = "; ".join(ingested(given.store, one["voyage"])) if (
            given.store / f"voyage={one['voyage']}"
        ).exists() else "not in the store"  # fmt: skip
        own = "; ".join(dict.fromkeys(diagnosed(verdict, one["voyage"])))
        said = one["said"] or [{"second": "", "what": "", "sentence": "nothing"}]
        for i, word in enumerate(said):
            kind = f"{word['what']}: " if word["what"] else ""
            head = (
                f"| {one['voyage']} | {'yes' if one['trained'] else 'no'} | {one['seconds']:.0f} | "
                f"{one['segments']} | {most} | {inside} |" if i == 0 else "| | | | | | |"
            )  # fmt: skip
            tail = f" {there or '-'} | {own or '-'} |" if i == 0 else " | |"
            yield f"{head} {word['second']} | {kind}{word['sentence']} |{tail}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("run", "store", "logs", "out"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--per-day", type=float, default=24.0)
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--verdict", type=Path)
    given = parser.parse_args()
    if not given.report:
        with threadpool_limits(1, user_api="blas"):
            watch_all(given)
    print(*report(given), sep="\n")


if __name__ == "__main__":
    main()
