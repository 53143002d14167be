"""Lines of NMEA 0183 or Signal K as messages: the last ones are converted anew at each look.

What a sentence means depends on those about it: its date, its clock, which talker is heard. So the
lines of the last KEPT_S are read as `ingest` reads a whole text, and what is new of it is given.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import polars as pl

from shiplog.exceptions import ShiplogError
from shiplog.live.causal_rows import quietly
from shiplog.logs.conversion import nmea, signalk
from shiplog.logs.conversion.write import Series
from shiplog.machine import files
from shiplog.nomenclature.units import SECOND_NS

KEPT_S = 120.0
MOST_LINES = 100_000  # of the last KEPT_S: a line of megabits
LONGEST_LINE = 1 << 16  # bytes: a line without an end is no line
JSON_LINE = re.compile(r"^\s*(\d{10,16};[A-Z];|\{)")


@dataclass
class TextLines:
    """Lines since a moment ago, and what of them was given."""

    name: str
    lines: list[tuple[int, str]] = field(default_factory=list)  # (batch, line)
    heard: dict[int, int] = field(default_factory=dict)  # batch → latest time then, ns
    given: dict[str, int] = field(default_factory=dict)  # topic → latest time given, ns
    batch: int = 0
    rest: bytes = b""

    def split(self, data: bytes) -> list[str]:
        """Whole lines of what came; half a line waits for the rest of it."""
        *whole, self.rest = (self.rest + data).split(b"\n")
        if len(self.rest) > LONGEST_LINE:
            self.rest = b""
        return [line.decode("utf-8", "replace").rstrip("\r") for line in whole]

    def messages(self, lines: Sequence[str]) -> tuple[dict[str, pl.DataFrame], str]:
        """What is new by topic, and why nothing can be read of the lines so far."""
        if not lines:
            return {}, ""
        self.batch += 1
        self.lines += [(self.batch, line) for line in lines if line.strip()]
        self.lines = self.lines[-MOST_LINES:]
        try:
            with quietly():
                series = read([line for _, line in self.lines], self.name)
        except ShiplogError as error:
            return {}, error.message
        return self._new(series), ""

    def _new(self, series: Sequence[Series]) -> dict[str, pl.DataFrame]:
        found = {}
        latest = 0
        for one in series:
            frame = as_frame(one)
            times = frame["log_time"].to_numpy()
            latest = max(latest, int(times.max(initial=0)))
            new = times > self.given.get(one.topic, 0)
            if new.any():
                found[one.topic] = frame.filter(pl.Series(new))
                self.given[one.topic] = int(times.max())
        self.heard[self.batch] = latest
        old = {b for b, time in self.heard.items() if time < latest - KEPT_S * SECOND_NS}
        if old:
            self.lines = [one for one in self.lines if one[0] not in old]
            self.heard = {b: time for b, time in self.heard.items() if b not in old}
        return found


def read(lines: Sequence[str], name: str) -> list[Series]:
    """Topics of lines, as `ingest` has them. Raises ChannelMissing."""
    if not any(JSON_LINE.match(line) for line in lines):
        return nmea.read_sentences(lines, name).series
    with files.temporary_folder() as folder:
        path = folder / "lines.log"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return signalk.read_signalk(path, name).series


def as_frame(series: Series) -> pl.DataFrame:
    """A topic's messages as a log would give them."""
    time = np.asarray(series.time, np.int64)
    logged = time if series.log_time is None else np.asarray(series.log_time, np.int64)
    published = time if series.publish_time is None else np.asarray(series.publish_time, np.int64)
    columns = {name: np.asarray(v) for name, v in series.columns.items() if np.ndim(v) == 1}
    frame = pl.DataFrame({"log_time": logged, "publish_time": published, "stamp": time} | columns)
    return frame.sort("log_time", maintain_order=True)
