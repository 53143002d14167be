"""A verdict on one page, for people."""

from __future__ import annotations

from shiplog.report.diagnosis.sections import (
    causes,
    gain,
    intervals,
    limits,
    ranking,
    reasons,
    traces,
    unseen,
    wrong,
)
from shiplog.report.diagnosis.sections.written import bullets
from shiplog.report.diagnosis.verdict import Verdict

SECTIONS = (  # in the order of the page
    lambda v: causes.markdown(v.causes),
    lambda v: gain.markdown(v.gain, v.without),
    lambda v: ranking.markdown(v.ranking),
    lambda v: reasons.markdown("Rejected", v.rejected),
    lambda v: reasons.markdown("Not testable", v.unavailable),
    lambda v: traces.markdown(v.traces),
    lambda v: limits.markdown(v.limits),
    lambda v: wrong.markdown(v.wrong),
    lambda v: unseen.markdown(v.unseen),
    lambda v: intervals.markdown(v.intervals),
    lambda v: bullets("Notes", v.notes),
)


def lines(verdict: Verdict) -> list[str]:
    """Markdown: the causes with numbers and gain, what was rejected or could not be tested and why,
    where errors are."""
    found = ["# Diagnosis", "", f"**{verdict.sentence}**", ""]
    found += [f"Model: {verdict.run}, {verdict.made}.", ""]
    for section in SECTIONS:
        found += section(verdict)
    return found


def markdown(verdict: Verdict) -> str:
    return "\n".join(lines(verdict))
