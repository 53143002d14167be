"""The answer of a diagnosis, in the contract's words."""

from __future__ import annotations

from dataclasses import dataclass

from shiplog.diagnosis.residual.interval import Interval
from shiplog.nomenclature.contract import CONTRACT
from shiplog.report.diagnosis.sections import gain
from shiplog.report.diagnosis.sections.causes import NamedCause
from shiplog.report.diagnosis.sections.contradictions import Contradiction
from shiplog.report.diagnosis.sections.limits import NONE_TESTED, Limit, NotShown
from shiplog.report.diagnosis.sections.ranking import Ranked
from shiplog.report.diagnosis.sections.reasons import Reason
from shiplog.report.diagnosis.sections.structure import Structure
from shiplog.report.diagnosis.sections.subject import Subject
from shiplog.report.diagnosis.sections.traces import Trace
from shiplog.report.diagnosis.sections.unseen import Omitted
from shiplog.report.diagnosis.sections.written import as_json
from shiplog.report.diagnosis.sections.wrong import ChannelError
from shiplog.simulation.error_reduction import Gain


@dataclass(frozen=True, slots=True)
class Base:
    """The model.

    before_effect  whether the run was fitted to other voyages than these, which are in the store
    """

    run: str
    before_effect: bool


@dataclass(frozen=True)
class Verdict:
    """The answer of `shiplog diagnose`.

    verdict    named, none, unknown, undecided, coverage or external
    sentence   the answer in words
    made       what the model was fitted to
    without    the data that the numbers of each held-out window were fitted without
    contradictions  of the voyages' reports, while which no cause of their channels is named
    hidden     how many causes could not have shown
    subject    what it is about: ship, run, voyages
    """

    verdict: str
    sentence: str
    run: str
    before_effect: bool
    made: str
    causes: tuple[NamedCause, ...] = ()
    ranking: tuple[Ranked, ...] = ()
    rejected: tuple[Reason, ...] = ()
    traces: tuple[Trace, ...] = ()
    wrong: tuple[ChannelError, ...] = ()
    structure: Structure | None = None
    intervals: tuple[Interval, ...] = ()
    gain: Gain | None = None
    without: str = "its voyage"
    unseen: tuple[Omitted, ...] = ()
    limits: tuple[Limit, ...] = ()
    unavailable: tuple[Reason, ...] = ()
    notes: tuple[str, ...] = ()
    contradictions: tuple[Contradiction, ...] = ()
    hidden: NotShown = NONE_TESTED
    subject: Subject | None = None

    @property
    def explained(self) -> float:
        """Share of the held-out error that the named causes take away."""
        return max(self.gain.reduction, 0.0) if self.gain and self.causes else 0.0

    def as_json(self) -> dict:
        found = {
            "contract": CONTRACT,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "causes": self.causes,
            "ranking": self.ranking,
            "rejected": self.rejected,
            "traces": self.traces,
            "wrong": self.wrong,
            "intervals": self.intervals,
            "unseen": self.unseen,
            "limits": self.limits,
            "unavailable": self.unavailable,
            "explained": self.explained,
            "notes": self.notes,
            "contradictions": self.contradictions,
            "not_shown": self.hidden,
            "base": Base(self.run, self.before_effect),
        }
        if self.subject is not None:
            found["subject"] = self.subject
        if self.structure is not None:
            found["structure"] = self.structure
        if self.gain is not None:
            found["gain"] = gain.of(self.gain)
        return as_json(found)
