"""Two instruments on one topic: two frames of reference, or two publishers, that take turns.

Fix about fix of two antennas is no motion. What a profile does not choose, the more frequent one
is taken for, and said; `frame` in the profile names it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import polars as pl

from shiplog.exceptions import ChannelMissing, listed
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.logs.reading.senders import CHANNEL, Senders, senders
from shiplog.nomenclature.units import SECOND_NS
from shiplog.ship_profile.profile import Profile, Source
from shiplog.voyages.samples import status

FRAMES = ("header.frame_id", "frame_id")
SENDER = ":sender"  # the column of who sent a message, where several do
# Those that take turns do so all the time; a receiver that was renamed does it once, and a frame
# that stands in a few messages is none of an instrument.
LEAST_TURNS, LEAST_SHARE = 10, 0.05


def several(path: Path, profile: Profile) -> dict[str, Senders]:
    """The topics of a profile on which more than one sends, or of which it names one."""
    asked: dict[str, list[str]] = {}
    chosen = set()
    for _, source in status.sources(profile):
        asked.setdefault(source.topic, []).extend(frames_of(source))
        if source.frame:
            chosen.add(source.topic)
    found = senders(path, {topic: list(dict.fromkeys(paths)) for topic, paths in asked.items()})
    return {topic: one for topic, one in found.items() if one.several or topic in chosen}


def frames_of(source: Source) -> list[str]:
    """Where the frame of a source's values may stand, in its own part of the message first."""
    return [place + name for place in status.parents(source) for name in FRAMES]


def wanted(found: Mapping[str, Senders]) -> dict[str, set[str]]:
    """Topic → fields that tell the senders apart."""
    return {topic: {CHANNEL, *one.frames} for topic, one in found.items()}


def told_apart(
    reading: Reading, profile: Profile, found: Mapping[str, Senders]
) -> tuple[Reading, Profile, list[Finding]]:
    """The log with a column of who sent each message, the profile with one chosen wherever they
    take turns, and what was chosen. Raises ChannelMissing for a `frame` that nobody has."""
    frames, findings = dict(reading.frames), {}
    chosen: dict[int, str] = {}
    for _, source in status.sources(profile):
        one, frame = found.get(source.topic), reading.frames.get(source.topic)
        if one is None or frame is None or frame.height == 0:
            continue
        label = _labels(frame, source, one)
        counts = {name: count for name, count in label.value_counts(sort=True).iter_rows()}
        frames[source.topic] = frames[source.topic].with_columns(label.alias(SENDER))
        if source.frame and source.frame not in counts:
            raise ChannelMissing(
                f"{reading.contents.path.name}: nobody sends on {source.topic} with the frame "
                f"{source.frame!r}. Senders found: {listed(map(repr, counts))}.",
                hint="correct `frame` in the ship profile, or leave it out.",
            )
        if source.frame or not _take_turns(label, counts):
            continue
        chosen[id(source)] = next(iter(counts))
        findings[source.topic] = _finding(source.topic, counts, frame)
    return replace(reading, frames=frames), _with(profile, chosen), list(findings.values())


def of_one(frame: pl.DataFrame, source: Source) -> pl.DataFrame:
    """The messages of the sender that a source names."""
    if source.frame is None or SENDER not in frame.columns:
        return frame
    return frame.filter(pl.col(SENDER) == source.frame)


def _labels(frame: pl.DataFrame, source: Source, found: Senders) -> pl.Series:
    """Who sent each message [n]: by its frame, else by its channel."""
    for path in frames_of(source):
        if path in frame.columns and frame.schema[path] == pl.String:
            label = frame[path].fill_null("")
            if label.n_unique() > 1 or source.frame in label:
                return label
    if CHANNEL in frame.columns and len(found.channels) > 1:
        names = {number: name for number, name in found.channels.items()}
        return frame[CHANNEL].replace_strict(names, default="", return_dtype=pl.String)
    return pl.Series([""] * frame.height, dtype=pl.String)


def _take_turns(label: pl.Series, counts: Mapping[str, int]) -> bool:
    """Whether the second of the senders sends between the first one's messages all the time."""
    if len(counts) < 2:
        return False
    fewer = sorted(counts.values())[-2]
    turns = int((label != label.shift(1)).sum())
    return turns >= LEAST_TURNS and turns >= LEAST_SHARE * fewer


def _with(profile: Profile, chosen: Mapping[int, str]) -> Profile:
    if not chosen:
        return profile

    def named(source):
        frame = chosen.get(id(source))
        return source.model_copy(update={"frame": frame}) if frame is not None else source

    sensors = {name: named(sensor) for name, sensor in profile.sensors.items()}
    return profile.model_copy(update={
        "sensors": profile.sensors.model_copy(update=sensors),
        "actuators": tuple(named(one) for one in profile.actuators),
    })  # fmt: skip


def _finding(topic: str, counts: Mapping[str, int], frame: pl.DataFrame) -> Finding:
    passed = max(int(frame["log_time"][-1]) - int(frame["log_time"][0]), 1) / SECOND_NS
    each = [f"{name!r} ({count / passed:.2g} Hz)" for name, count in counts.items()]
    first, *others = counts
    sentence = (
        f"{len(counts)} take turns on {topic}: {listed(each)}. Only the messages of {first!r} are "
        f'used. Name the one that is meant in the profile, as frame = "{first}" or '
        f'frame = "{others[0]}", with its own lever_arm_m.'
    )
    return Finding(
        "two_sources", topic, sentence, value=float(len(counts)), unit="sources", reason="frame"
    )
