"""A model next to its ship while it sails: a line an event, until the source ends."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from shiplog.live import kept, nominal, preparation, sources, summary, watch_pace
from shiplog.live.alarm import Alarm
from shiplog.live.events import Event, as_json
from shiplog.live.session import Watch
from shiplog.live.summary import Watched
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import Run
from shiplog.voyages.samples import fields_read
from shiplog.voyages.store.store import Store

log = logging.getLogger(__name__)

Emit = Callable[[str], None]


@dataclass
class Reporter:
    """Where events go: a line of JSON each, or of text."""

    text: Emit
    lines: Emit | None = None
    drawn: Callable[[Event], None] | None = None
    counts: summary.Counts = field(default_factory=summary.Counts)

    def event(self, event: Event) -> None:
        self.counts.note(event)
        if self.drawn is not None:
            self.drawn(event)
        if self.lines is not None and (line := as_json(event)) is not None:
            self.lines(json.dumps(line))
        if (words := summary.line(event)) is not None:
            self.text(words)

    def fact(self, fact: dict[str, Any], words: str) -> None:
        if self.lines is not None:
            self.lines(json.dumps(fact))
        self.text(words)


@threadpool_limits.wrap(limits=1, user_api="blas")
def watch_command(
    source: str,
    run_path: Path,
    store: Store,
    out: Path,
    reporter: Reporter,
    *,
    per_day: float,
    stop_after_s: float | None = None,
    anew: bool = False,
    now: Callable[[], int] = time.time_ns,
    sleep: Callable[[float], None] = time.sleep,
) -> Watched:
    """Until the source ends, or nothing came for `stop_after_s`. Raises ShiplogError.

    anew        do not go on from an earlier watch of this source in `out`
    now, sleep  this machine's clock [ns], and how to wait
    """
    run = load_model.load(run_path)
    saved = None if anew else kept.load(out)
    place = None if saved is None else saved.facts.get("place")
    opened = sources.opened(source, fields_read.wanted(run.profile, {}), place)
    watch = _prepared(run, run_path, store, opened, out, per_day, reporter)
    if saved is not None and watch.resume(saved):
        reporter.fact(*summary.resumed(watch))
    pace = watch_pace.Pace(stop_after_s)
    try:
        while not watch.done and not pace.over(watch, now()):
            for event in watch.step(now()):
                reporter.event(event)
                if isinstance(event, Alarm):
                    _propose(watch, store, reporter, run_path)
            if not watch.busy:
                sleep(watch_pace.LOOK_S)
    except KeyboardInterrupt:
        log.info("stopped by the user")
    finally:
        opened.close()
    for event in watch.finish(now()):
        reporter.event(event)
    _propose(watch, store, reporter, run_path, last=True)
    return summary.watched(watch, reporter.counts, source, run)


def _prepared(
    run: Run, run_path: Path, store: Store, opened: sources.Source, out: Path, per_day: float,
    reporter: Reporter,
) -> Watch:  # fmt: skip
    why = nominal.why_none(run, store)
    prepared = None if why else preparation.campaign_of(run, run_path, store)
    if prepared is None:
        reporter.fact(*summary.without_alarm(why))
        return Watch(run, opened, out=out)
    campaign, found = prepared
    reporter.fact(*summary.begun(found, per_day))
    return Watch(run, opened, campaign, found, found.watcher(per_day), out)


def _propose(
    watch: Watch, store: Store, reporter: Reporter, run_path: Path, last: bool = False
) -> None:
    """The kept rows as a voyage of the store, and the command that diagnoses it."""
    name = watch.keep_voyage(store, last)
    if name:
        reporter.fact(*summary.proposed(name, run_path, store.path))
