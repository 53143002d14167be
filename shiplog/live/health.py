"""Is it the ship, or what is measured of it? Asked before any suspicion.

A channel is silent when its last sample is older than MOST_MISSED of its periods and SILENT_S; it
is faulty while `ingest` would leave its rows out. The source is silent when nothing arrived for
QUIET_S by this machine's clock. The recorder's clock is compared with this machine's while
messages arrive one by one: a file that is read again lies behind it, and says nothing of a clock.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from shiplog.live.handling import Unlike
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.units import SECOND_NS
from shiplog.voyages.rows.fault_detection import FROZEN_S

SILENT_S = 2.0
MOST_MISSED = 8.0  # periods without a sample
QUIET_S = 5.0  # s without any message
CLOCK_S = 1.0  # s, from which a clock ahead of this machine's is reported
BEHIND_S = 60.0  # s, from which a source behind it is reported, once: it may be a recording
WHEN = re.compile(r",? for [\d.]+ s from [\d.]+ s(?=\.)")
CHANNEL_FAULTS = ("held", "status", "contradiction", "implausible", "clock_offset", "two_sources")


@dataclass(frozen=True)
class Heard:
    """When a channel was heard last [ns], and its usual period [s]."""

    last: int
    period_s: float


@dataclass(frozen=True)
class Notice:
    """Something to know of the source. `over`: it is right again."""

    time: int  # ns
    what: str  # silent, quiet, clock, fault, handling, refused, damaged, restarted
    channel: str
    sentence: str
    over: bool = False


@dataclass
class Health:
    """What is wrong with the source now, by what and channel."""

    now: dict[tuple[str, str], Notice] = field(default_factory=dict)
    said: set[tuple[str, str, str]] = field(default_factory=set)

    @property
    def bad(self) -> list[str]:
        """Channels on which no suspicion may rest."""
        return sorted({channel for what, channel in self.now if what in ("silent", "fault")})

    def channels(self, heard: Mapping[str, Heard], newest: int) -> list[Notice]:
        """Of channels that have fallen silent, or speak again; `newest` is the latest message."""
        found = []
        for name, one in heard.items():
            missing = (newest - one.last) / SECOND_NS
            silent = missing > max(SILENT_S, MOST_MISSED * one.period_s)
            found += self._turn("silent", name, silent, newest,
                                f"{name} is silent: nothing for {missing:.1f} s.",
                                f"{name} is back.")  # fmt: skip
        return found

    def arrivals(self, last: int | None, clock: int, name: str) -> list[Notice]:
        """Of the source: when anything arrived last, and now, by this machine's clock [ns]."""
        if last is None:
            return []
        missing = (clock - last) / SECOND_NS
        return self._turn("quiet", "source", missing > QUIET_S, clock,
                          f"{name} is silent: no message for {missing:.0f} s.",
                          f"{name} sends again.")  # fmt: skip

    def clock(self, logged: int, clock: int, live: bool) -> list[Notice]:
        """Of the recorder's clock, by the latest log time and this machine's clock [ns]."""
        ahead = (logged - clock) / SECOND_NS
        found = self._turn("clock", "ahead", ahead > CLOCK_S, clock,
                           f"The recorder's clock is {ahead:.1f} s ahead of this machine's.",
                           "The recorder's clock is no longer ahead.")  # fmt: skip
        if live:
            found += self._turn(
                "clock", "behind", -ahead > BEHIND_S, clock,
                f"The latest message is {-ahead:.0f} s old: a recording, or a clock behind.",
                "Messages are as of now.",
            )  # fmt: skip
        return found

    def faults(self, findings: Sequence[Finding], since_s: float, time: int) -> list[Notice]:
        """Of what `ingest` would say of the last messages, that is so still; each sentence once.

        since_s   s into these messages, from which a finding is of now
        """
        lasting = {f.channel: f for f in findings if _is_fault(f)
                   and (f.end_s is None or f.end_s >= since_s)}  # fmt: skip
        found = []
        for channel, finding in lasting.items():
            found += self._turn("fault", channel, True, time, _of_now(finding.sentence), "")
        for _, channel in [key for key in self.now if key[0] == "fault" and key[1] not in lasting]:
            found += self._turn("fault", channel, False, time, "", f"{channel} is right again.")
        return found

    def handling(self, found: Sequence[Unlike], time: int) -> list[Notice]:
        """Of the actuators that a segment moved as no training voyage does, and of those that are
        moved again as they do."""
        new = {one.actuator: one.sentence for one in reversed(found)}
        notices = []
        for name, sentence in new.items():
            notices += self._turn("handling", name, True, time, sentence, "")
        for _, name in [key for key in self.now if key[0] == "handling" and key[1] not in new]:
            right = f"{name} is moved as in the training voyages again."
            notices += self._turn("handling", name, False, time, "", right)
        return notices

    def once(self, what: str, channel: str, sentence: str, time: int) -> list[Notice]:
        """Something that happened; the same words are not said twice."""
        if (what, channel, sentence) in self.said:
            return []
        if len(self.said) > 1000:  # of a source that finds ever new words
            self.said.clear()
        self.said.add((what, channel, sentence))
        return [Notice(time, what, channel, sentence)]

    def _turn(
        self, what: str, channel: str, wrong: bool, time: int, sentence: str, right: str
    ) -> list[Notice]:
        key = what, channel
        if wrong and key not in self.now:
            self.now[key] = Notice(time, what, channel, sentence)
            return [self.now[key]]
        if not wrong and key in self.now:
            del self.now[key]
            return [Notice(time, what, channel, right, over=True)]
        return []


def _is_fault(finding: Finding) -> bool:
    """Not a value that repeats for a moment: such rows are marked, and good enough."""
    if finding.kind != "held":
        return finding.kind in CHANNEL_FAULTS
    return finding.unit == "s" and (finding.value or 0.0) >= FROZEN_S


def _of_now(sentence: str) -> str:
    """Without the seconds of the window that a finding counts from."""
    return WHEN.sub("", sentence)
