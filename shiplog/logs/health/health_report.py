"""What a log's health report consists of: one finding a fault, with its time, size and sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is not as it should be. Times are seconds from the voyage's first row."""

    kind: str  # one of FINDING_KINDS
    channel: str  # a canonical channel, an actuator, a topic, or "log"
    sentence: str
    start_s: float | None = None
    end_s: float | None = None
    value: float | None = None
    low: float | None = None
    high: float | None = None
    unit: str = ""
    reason: str = ""  # one of REASONS: of a contradiction, or of two sources to choose between

    @property
    def serious(self) -> bool:
        """Whether `check` and `ingest` end with exit 3 for it."""
        return self.kind in SERIOUS or (self.kind == "two_sources" and bool(self.reason))


REASONS = ("unit", "sign", "frame", "swapped", "clock", "mounting", "none known")
SERIOUS = frozenset({"crc", "truncated", "contradiction"})  # `check` and `ingest` end with exit 3
FINDING_KINDS = (
    "gap",
    "held",
    "spike",
    "blank",
    "jump",
    "duplicate",
    "out_of_order",
    "limits",
    "crc",
    "truncated",
    "clock_offset",
    "heading_offset",
    "antenna_offset",
    "yaw_rate_bias",
    "yaw_rate_scale",
    "velocity_scale",
    "external",
    "contradiction",  # two channels exclude each other
    "status",  # not valid, by the instrument's own word
    "implausible",
    "not_available",
    "wrapped",
    "restarted",
    "burst",
    "two_sources",
    "dropped",  # samples that are not used, with their number
)


@dataclass(frozen=True, slots=True)
class NotCompared:
    """What two channels cannot say of each other in this voyage, or in no voyage at all."""

    what: str  # such as "the yaw rate with the heading"
    reason: str
    would_show: str  # what would have to be recorded or sailed


@dataclass(frozen=True, slots=True)
class Instrument:
    """How often and how finely one channel was recorded."""

    channel: str
    rate_hz: float
    resolution: float  # the step in which it counts, in `unit`; 0 where none shows
    unit: str
    sigma: float = 0.0  # stated, else estimated from the record, in `unit`; 0 where none is known
    clock_s: float = 0.0  # by how much the time of a sample can be off, by what its stamps show


@dataclass(frozen=True, slots=True)
class DerivedChannel:
    """A channel that no instrument measured, and how well it is known all the same."""

    channel: str
    of: str  # the channel that it is derived from
    sigma: float  # standard deviation of a row, in `unit`
    sigma_mean: float  # the same of a mean over one second
    unit: str
    sample_sigma: float  # σ of one sample of `of`, in m or deg
    jerk: float  # √q of the smoother, in m or deg and s^-2.5


@dataclass(frozen=True, slots=True)
class VoyageReport:
    """The contract's answer of `check` and `ingest` for one log.

    instruments that have two samples at least: of fewer no rate is known
    usable_s    seconds that can be averaged to 1 Hz; None where the log was not ingested
    windows     of `channels.WINDOW` such seconds in a row; None likewise
    derived     channels that no instrument measures
    """

    name: str
    messages_read: int
    messages_lost: int | None  # None: a lost chunk does not say how many it held
    rows: int
    seconds: float
    findings: tuple[Finding, ...] = field(default=())
    usable_s: int | None = None
    windows: int | None = None
    instruments: tuple[Instrument, ...] = field(default=())
    not_compared: tuple[NotCompared, ...] = field(default=())
    derived: tuple[DerivedChannel, ...] = field(default=())

    @property
    def contradictions(self) -> tuple[Finding, ...]:
        """What two channels say that cannot both be right."""
        return tuple(finding for finding in self.findings if finding.kind == "contradiction")

    @property
    def serious(self) -> bool:
        """Whether something was lost, or two channels exclude each other."""
        return self.messages_lost != 0 or any(f.serious for f in self.findings)

    @property
    def slowest(self) -> Instrument | None:
        """The instrument that measures least often."""
        return min(self.instruments, key=lambda one: one.rate_hz, default=None)

    @classmethod
    def from_json(cls, content: dict) -> VoyageReport:
        """What `as_json` made."""
        counts = content["messages"]
        return cls(
            content["name"], counts["read"], counts["lost"], content["rows"], content["seconds"],
            tuple(Finding(**finding) for finding in content["findings"]),
            content["usable_s"], content["windows"],
            tuple(Instrument(**one) for one in content["instruments"]),
            tuple(NotCompared(**one) for one in content["not_compared"]),
            tuple(DerivedChannel(**one) for one in content.get("derived", ())),
        )  # fmt: skip

    def as_json(self) -> dict:
        return {
            "name": self.name,
            "messages": {"read": self.messages_read, "lost": self.messages_lost},
            "rows": self.rows,
            "seconds": self.seconds,
            "usable_s": self.usable_s,
            "windows": self.windows,
            "instruments": [asdict(one) for one in self.instruments],
            "findings": [asdict(finding) for finding in self.findings],
            "not_compared": [asdict(one) for one in self.not_compared],
            "derived": [asdict(one) for one in self.derived],
        }


def frame(findings: Mapping[str, Sequence[Finding]]) -> pl.DataFrame:
    """One row a finding: its voyage, then its fields.

    findings   voyage → what was found in it
    """
    import polars as pl

    numbers = ("start_s", "end_s", "value", "low", "high")
    names = [one.name for one in fields(Finding)]
    schema = {"voyage": pl.String} | {n: pl.Float64 if n in numbers else pl.String for n in names}
    rows = [{"voyage": name, **asdict(one)} for name, many in findings.items() for one in many]
    return pl.DataFrame(rows, schema)
