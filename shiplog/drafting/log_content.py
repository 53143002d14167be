"""A log as a draft looks at it: the fields of its topics, and their data once it is known which."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.drafting import facts, guesses, stated
from shiplog.drafting.guesses import Guess
from shiplog.exceptions import LogUnreadable, ProfileError
from shiplog.logs.decoding.fields import is_number
from shiplog.logs.reading.read import Contents, contents, fields, read

MMSI = re.compile(r"(?<![^/])\d{7,9}(?![^/])")  # 7 of a base station, whose zeros are lost
SLOW_S = 10.0  # s from message to message: no instrument of a voyage, where there is a faster one
FEW = 20  # messages of which it is told whether a value ever changes
IRREGULAR = 0.5  # standard deviation of the steps over their mean: sent when it changes
CHANGES = 0.9  # share of the messages that hold another value than the one before
SEARCHED = 200  # topics whose data are read at most, for the comments of the lines


@dataclass(frozen=True, slots=True)
class Choice:
    """A topic that may hold a channel."""

    topic: str
    paths: tuple[str, ...]
    guess: Guess


class Log:
    """A log as a draft looks at it: its topics' fields, and their data once it is known which."""

    def __init__(self, path: str | Path, vessel: str | None) -> None:
        self.contents: Contents = contents(path)
        leaves = {topic: tuple(columns) for topic, columns in fields(path).items() if columns}
        if not leaves:
            raise LogUnreadable(
                f"{self.contents.path.name} has no topic that can be decoded.",
                hint="`shiplog check` says why, topic by topic.",
            )
        self.leaves = _of_one_vessel(leaves, vessel, self.contents)
        self.data: dict[str, pl.DataFrame] = {}

    def said(self, topic: str) -> Mapping[str, str]:
        """The metadata of a topic's channel."""
        found = self.contents.topics.get(topic)
        return found.metadata if found else {}

    def look(self, wanted: dict[str, set[str]]) -> None:
        """Read the topics of the draft that were not read yet."""
        if wanted:
            self.data |= read(self.contents.path, dict(list(wanted.items())[:SEARCHED])).frames

    def holds(self, choice: Choice) -> bool:
        """Whether any value stands where a channel is looked for."""
        frame = self.data.get(choice.topic)
        if frame is None or not set(choice.paths) <= set(frame.columns):
            return False
        numbers = [self.column(choice.topic, path) for path in choice.paths]
        return all(bool(number.is_finite().any()) for number in numbers)

    def times(self, topic: str) -> np.ndarray:
        """When the messages were measured, else recorded [n] ns; a message without a stamp has the
        recorder's."""
        frame = self.data.get(topic)
        if frame is None:
            return np.zeros(0, np.int64)
        stamped = frame["stamp"] if "stamp" in frame.columns else frame["log_time"]
        return stamped.fill_null(frame["log_time"]).to_numpy()

    def life(self, choice: Choice) -> int:
        """0 of a topic whose values change; 1 of one that comes seldom; 2 of one that stands still,
        as a home position does or a heading that nothing measures."""
        numbers = [self.column(choice.topic, path).fill_null(np.nan) for path in choice.paths]
        known = [n.filter(n.is_finite()).to_numpy() for n in numbers]
        fewest = min(len(n) for n in known)
        most = [float(np.abs(n).max(initial=0.0)) for n in known]
        geodetic = choice.guess.kind == "geodetic"
        if geodetic and fewest and max(most) == 0.0:
            return 2
        somewhere = not geodetic or most[0] <= facts.POLE
        if fewest >= FEW and somewhere and all(np.ptp(n) == 0.0 for n in known):
            return 2
        steps = np.diff(np.sort(self.times(choice.topic)))
        return int(fewest < 2 or float(np.median(steps)) * 1e-9 > SLOW_S)

    def liveliest(self, choices: list[Choice]) -> list[Choice]:
        """Of topics that may hold a channel those first that live, of these the one that the
        recorder itself used, else in the order they have."""
        counts = {one.topic: len(self.times(one.topic)) for one in choices}
        most = max(counts.values(), default=0)

        def key(one: Choice) -> int:
            few = counts[one.topic] < FEW and counts[one.topic] * 10 <= most
            return max(self.life(one), int(few))

        def chosen(one: Choice) -> bool:
            return stated.is_primary(self.said(one.topic))

        return sorted(choices, key=lambda one: (key(one), not chosen(one)))

    def describe_change(self, topic: str, path: str) -> str:
        """A line for a value that is sent when it changes: it holds until the next one."""
        frame, number = self.data.get(topic), self.column(topic, path).to_numpy()
        if frame is None or len(number) < FEW:
            return ""
        steps = np.diff(frame["log_time"].to_numpy()) * 1e-9
        changes = float(np.mean(np.diff(number) != 0))
        if steps.mean() <= 0 or steps.std() < IRREGULAR * steps.mean() or changes < CHANGES:
            return ""
        return 'between = "hold"  # sent when it changes\n'

    def rate(self, topic: str) -> str:
        frame = self.data.get(topic)
        return facts.of_times(frame["log_time"]) if frame is not None else "no message"

    def values(self, topic: str, path: str) -> str:
        frame = self.data.get(topic)
        return facts.of_values(frame[path]) if frame is not None and path in frame else "unread"

    def column(self, topic: str, path: str) -> pl.Series:
        """Numbers of a field; none where it was not read, or is a list of them."""
        frame = self.data.get(topic)
        if frame is None or path not in frame or not is_number(frame.schema[path]):
            return pl.Series(path, [], pl.Float64)
        return frame[path].cast(pl.Float64, strict=False)

    def drives(self, topic: str, path: str) -> bool:
        """Whether numbers stand where an actuator is looked for: a text drives nothing."""
        frame = self.data.get(topic)
        if frame is None or path not in frame.columns or frame[path].dtype == pl.Boolean:
            return False
        number = self.column(topic, path)
        number = number.filter(number.is_finite())
        still = len(number) >= FEW and number.n_unique() == 1 and number[0] == 0.0
        return len(number) > 0 and not still

    def unit(self, paths: Sequence[str], at: int, topic: str, takes: tuple[str, ...]) -> str | None:
        """What the field's own name says, or the channel's metadata, which has one unit."""
        stated = self.contents.topics[topic].metadata.get("unit") if len(paths) == 1 else None
        return guesses.known_unit(paths[at], stated, takes)


def _of_one_vessel(
    leaves: dict[str, tuple[str, ...]], vessel: str | None, found: Contents
) -> dict[str, tuple[str, ...]]:
    """Without the topics of other ships. Raises ProfileError where no ship was chosen."""
    counts: dict[str, int] = {}
    for topic in leaves:
        if match := MMSI.search(topic):
            counts[match[0]] = counts.get(match[0], 0) + (found.topics[topic].messages or 0)
    if len(counts) < 2 and vessel is None:
        return leaves
    if vessel is None or vessel not in counts:
        raise ProfileError(
            f"{found.path.name} holds {len(counts)} vessels"
            f"{'' if vessel is None else f', and none is {vessel}'}: "
            f"{facts.counted(counts, 'messages')}.",
            hint="say which with --vessel, by its MMSI.",
        )
    return {
        topic: paths
        for topic, paths in leaves.items()
        if not (match := MMSI.search(topic)) or match[0] == vessel
    }
