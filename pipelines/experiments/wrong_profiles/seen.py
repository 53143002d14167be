"""What `ingest` says of the sample logs read through a wrong profile, and the class of that."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from pipelines.experiments.wrong_profiles.profiles import Wrong, text_of
from shiplog.exceptions import ShiplogError
from shiplog.logs.health.health_report import Finding, NotCompared
from shiplog.ship_profile import file as profile_file
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.ingest.ingest import ingest

LOGS = Path(__file__).parents[3] / "sample_logs"
TRIAL = ("season3_1", "season3_2")  # nothing is hidden in it
WAYS = {"both campaigns": ("voyage_1", "voyage_3", *TRIAL), "the trial only": TRIAL,
        "one voyage": ("voyage_2",)}  # fmt: skip
NAMED = ("sensors", "plausibility")
KEY = re.compile(r"(?:Change: |[Ll]ook at |set )(.+?)(?:\. |\.?$)")


@dataclass(frozen=True)
class Seen:
    """Of one voyage: class, what is said first of the channel, the key, and what is said of other
    channels, which the right profile's voyage has not."""

    seen_by: str
    said: str
    key: str
    others: tuple[str, ...]


def seen(wrong: Wrong, voyage: str) -> Seen:
    try:
        report = ingest(LOGS / f"{voyage}.mcap", _profile(text_of(wrong))).report
    except ShiplogError as error:
        return Seen("plausibility", error.message, _key(str(error)), ())
    fresh = [f for f in report.findings if (f.kind, f.channel, f.start_s) not in _usual(voyage)]
    named = [f for f in fresh if _names(wrong.channel, f"{f.channel} {f.sentence}")]
    others = tuple(f"{f.kind} {f.channel}" for f in fresh if f not in named)
    named.sort(key=lambda f: f.kind != "contradiction")
    if named:
        by = "sensors" if _of_sensors(named[0]) else "plausibility"
        return Seen(by, named[0].sentence, _key(named[0].sentence), others)
    left = [n for n in report.not_compared if _names(wrong.listed or wrong.channel, n.what)]
    if left:
        return Seen("undetermined", _text(left[0]), "", others)
    return Seen("unsaid", "nothing", "", others)


def of_way(found: Sequence[Seen]) -> str:
    """The class of several voyages: one word where they agree."""
    classes = [one.seen_by for one in found]
    each = dict.fromkeys(classes)
    if len(each) == 1:
        return classes[0]
    return ", ".join(f"{one} in {classes.count(one)} of {len(classes)}" for one in each)


def _profile(text: str) -> Profile:
    return profile_file.parse(text, "wrong profile")


@lru_cache
def _usual(voyage: str) -> frozenset:
    """What is found through the right profile."""
    report = ingest(LOGS / f"{voyage}.mcap", _profile(text_of(None))).report
    return frozenset((f.kind, f.channel, f.start_s) for f in report.findings)


def _names(channel: str, text: str) -> bool:
    def plain(words: str) -> str:
        return words.lower().replace("_", " ")

    return plain(channel) in plain(text)


def _of_sensors(finding: Finding) -> bool:
    """Two channels that exclude each other do so over a time; a number of the profile has none."""
    return finding.kind == "contradiction" and finding.start_s is not None


def _key(sentence: str) -> str:
    found = KEY.search(sentence)
    return found[1].strip() if found else ""


def _text(left: NotCompared) -> str:
    return f"{left.what}: {left.reason}. Would show it: {left.would_show}."


def every(chosen: Sequence[Wrong], reach: Callable[[str], None]) -> dict[str, dict[str, Seen]]:
    """Name → voyage → what is said."""
    voyages = dict.fromkeys(voyage for names in WAYS.values() for voyage in names)
    found = {}
    for wrong in chosen:
        reach(wrong.name)
        found[wrong.name] = {voyage: seen(wrong, voyage) for voyage in voyages}
    return found
