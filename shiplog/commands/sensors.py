"""Stored voyages to what their sensors say of each other, campaign by campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime

import polars as pl

from shiplog.commands.bars import through
from shiplog.exceptions import listed
from shiplog.logs.health import health_report
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation import tables
from shiplog.report.result import Printed
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.sensors import campaign_consistency
from shiplog.voyages.sensors.campaign_consistency import SensorCampaign
from shiplog.voyages.sensors.sensor_findings import Estimate
from shiplog.voyages.store import parts
from shiplog.voyages.store.store import Store

SHARE_OF_RECORD = 5e-4  # s that a recorded second takes
PART_S = 600.0  # s, a part of a voyage, for the time that is left
ESTIMATED = ("kind", "channel", "value", "low", "high", "unit")  # of an estimate, in frame and JSON


def campaigns(store: Store, voyages: Sequence[str]) -> list[tuple[SensorCampaign, Profile]]:
    """Voyages of one ship, apart where none was sailed for a season. Raises StoreError."""
    chosen = store.select(list(voyages) or None)
    starts = {entry.name: datetime.fromisoformat(entry.start) for entry in store.entries()}
    begins = {}
    for name in chosen:
        part = None if name in starts else parts.parse(name)
        whole, later = (name, 0) if part is None else (part.whole, part.begin)
        begins[name] = starts[whole].timestamp() + later
    lengths = {entry.name: entry.seconds for entry in store.entries()}
    seasons = list(campaign_consistency.seasons(begins))
    found = []
    for names in through(seasons, "comparing sensors", lambda names: _expected_s(names, lengths)):
        profile = store.profile(names)
        rows = dict(zip(names, (t.collect() for t in store.tables(names)), strict=True))
        found.append((campaign_consistency.campaign(rows, profile), profile))
    return found


def _expected_s(names: Sequence[str], lengths: Mapping[str, float]) -> float:
    """Of a campaign: by what was recorded, up to what is used of it."""
    recorded = sum(lengths.get(name, PART_S) for name in names)
    return SHARE_OF_RECORD * min(recorded, campaign_consistency.CAMPAIGN_ROWS / 10.0)


@dataclass(frozen=True, repr=False)
class SensorComparison(Printed):
    """What the sensors of stored voyages say of each other, campaign by campaign, with the profile
    of each."""

    campaigns: tuple[tuple[SensorCampaign, Profile], ...]

    def __repr__(self) -> str:
        found = counted(
            sum(len(one.findings(profile)) for one, profile in self.campaigns), "finding"
        )
        return f"SensorComparison({counted(len(self.campaigns), 'campaign')}, {found})"

    @property
    def estimates(self) -> pl.DataFrame:
        """One row an estimate: campaign (from 0), whether it is reported, kind, channel, value,
        low, high (90 % interval), unit."""
        rows = [
            {"campaign": number, "reported": e.notable, **{k: getattr(e, k) for k in ESTIMATED}}
            for number, (one, _) in enumerate(self.campaigns) for e in one.estimates
        ]  # fmt: skip
        schema = {
            "campaign": pl.Int64, "reported": pl.Boolean, "kind": pl.String, "channel": pl.String,
            "value": pl.Float64, "low": pl.Float64, "high": pl.Float64, "unit": pl.String,
        }  # fmt: skip
        return pl.DataFrame(rows, schema)

    @property
    def findings(self) -> pl.DataFrame:
        """One row a finding of all voyages of a campaign together: its first voyage, kind, ..."""
        return health_report.frame(
            {one.voyages[0]: one.findings(profile) for one, profile in self.campaigns}
        )

    @property
    def lines(self) -> list[str]:
        text = [line for one, profile in self.campaigns for line in _lines(one, profile)]
        while text and not text[-1]:
            text.pop()
        return text

    @property
    def json(self) -> dict:
        found = [_json(one, profile) for one, profile in self.campaigns]
        return {"contract": CONTRACT, "campaigns": found}


def compare_sensors(store: Store, voyages: Sequence[str]) -> SensorComparison:
    """`shiplog voyages --sensors`. Raises StoreError."""
    return SensorComparison(tuple(campaigns(store, voyages)))


def _lines(one: SensorCampaign, profile: Profile) -> list[str]:
    first, last = one.voyages[0], one.voyages[-1]
    count = len(one.voyages)
    text = [f"{count} voyages, {first} to {last}:" if count > 1 else f"{first}:", ""]
    rows = [
        (e.kind, e.channel, _cell(e), e.unit, "yes" if e.notable else "no",
         ", ".join(d.voyage for d in one.deviating.get((e.kind, e.channel), ())) or "-")
        for e in one.estimates
    ]  # fmt: skip
    head = ("kind", "channel", "value (90 % interval)", "unit", "reported", "deviating voyages")
    for name, contradicting in one.contradicting.items():
        text += [f"- contradiction in {name}: {f.sentence}" for f in contradicting]
    text += [""] if one.contradicting else []
    text += [tables.table(head, rows), ""] if rows else ["no two sensors can be fitted", ""]
    text += [f"- {finding.sentence}" for finding in one.findings(profile)] + [""]
    return text + _not_compared(one)


def _not_compared(one: SensorCampaign) -> list[str]:
    """A line for each comparison that could not be made, and of which voyages, if not of all."""
    lines = []
    for left, names in one.incomparable.items():
        where = "" if len(names) == len(one.voyages) else f" ({listed(names)})"
        lines.append(
            f"- not compared: {left.what}{where}: {left.reason}. It would take: {left.would_show}."
        )
    return [*lines, ""] if lines else []


def _cell(e: Estimate) -> str:
    return f"{e.value:.3f} ({e.low:.3f} to {e.high:.3f})"


def _json(one: SensorCampaign, profile: Profile) -> dict:
    return {
        "voyages": list(one.voyages),
        "estimates": [
            {key: asdict(e)[key] for key in ESTIMATED}
            | {"said": e.notable}
            for e in one.estimates
        ],
        "findings": [asdict(finding) for finding in one.findings(profile)],
        "contradictions": [
            {"voyage": name, **asdict(finding)}
            for name, found in one.contradicting.items() for finding in found
        ],
        "not_compared": [
            {"voyages": list(names), **asdict(left)} for left, names in one.incomparable.items()
        ],
        "deviating": [
            {"kind": kind, "channel": channel, "voyage": d.voyage, "value": d.estimate.value,
             "low": d.estimate.low, "high": d.estimate.high}
            for (kind, channel), others in one.deviating.items() for d in others
        ],
    }  # fmt: skip
