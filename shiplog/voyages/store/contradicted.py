"""What the stored reports of voyages say of gross contradictions: sensors that exclude each other,
and numbers of the profile that cannot be. What is made of such rows is wrong."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from shiplog.exceptions import listed
from shiplog.logs.health.health_report import Finding
from shiplog.voyages.store.store import Store

MOST_SAID = 3  # contradictions of a sentence, of which the others are counted
# Share of a voyage's time, up to which a contradiction is one stretch of it and not the voyage: as
# many windows as may be left out of a tenth of the record, which decide nothing.
STRETCH = 0.1


@dataclass(frozen=True, slots=True)
class Contradicted:
    """One contradiction of a voyage, and the share of its time that it covers."""

    voyage: str
    finding: Finding
    share: float = 1.0

    @property
    def channel(self) -> str:
        return self.finding.channel

    def as_json(self) -> dict:
        of = self.finding
        return {
            "voyage": self.voyage, "channel": of.channel, "reason": of.reason,
            "sentence": of.sentence,
        }  # fmt: skip


def list_contradicted(store: Store, names: Iterable[str]) -> tuple[Contradicted, ...]:
    """Of these voyages, or parts of voyages, as they were ingested."""
    found = []
    for name in names:
        part = store.part_of(name)
        report = store.report(part.whole if part else name)
        begin, end = (part.begin, part.end) if part else (0.0, report.seconds)
        for one in report.contradictions:
            low = begin if one.start_s is None else max(one.start_s, begin)
            high = end if one.end_s is None else min(one.end_s, end)
            if high > low or one.start_s is None:
                share = (high - low) / max(min(end, report.seconds) - begin, 1e-9)
                found.append(Contradicted(name, one, min(share, 1.0)))
    return tuple(found)


def everywhere(found: Iterable[Contradicted]) -> tuple[Contradicted, ...]:
    """Those that are of a voyage, and not of a short stretch of it."""
    return tuple(one for one in found if one.share > STRETCH)


def channels(found: Iterable[Contradicted]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(one.channel for one in found))


def text(found: Sequence[Contradicted]) -> str:
    """Each contradiction once, with its voyages; empty where there is none."""
    groups: dict[tuple[str, str], list[Contradicted]] = {}
    for one in found:
        groups.setdefault((one.channel, one.finding.reason), []).append(one)
    said = [
        f"in {listed((one.voyage for one in group), most=4)}, {_begun(group[0].finding.sentence)}"
        for group in list(groups.values())[:MOST_SAID]
    ]
    if not said:
        return ""
    more = len(groups) - len(said)
    rest = f" There are {more} more; `shiplog ingest` lists them." if more else ""
    return f"What was recorded contradicts itself: {' Also, '.join(said)}{rest}"


def _begun(sentence: str) -> str:
    """A sentence that goes on after a comma; a name or a symbol keeps its capitals."""
    first, _, rest = sentence.partition(" ")
    return sentence if not first.istitle() else f"{first.lower()} {rest}"
