"""A verdict on one page, for people."""

from __future__ import annotations

from shiplog.report.diagnosis.sections import (
    causes,
    gain,
    intervals,
    limits,
    ranking,
    reasons,
    subject,
    traces,
    unseen,
    wrong,
)
from shiplog.report.diagnosis.sections.written import bullets
from shiplog.report.diagnosis.terms import TERMS
from shiplog.report.diagnosis.verdict import Verdict
from shiplog.report.evaluation.text_table import inert

TERMS_FOLD = (
    "<details>\n<summary>Terms of the method</summary>\n\n"
    + "\n".join(f"- **{term}**: {text}" for term, text in TERMS)
    + "\n\n</details>\n"
)
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
    about = f"Model: {verdict.run}, {verdict.made}."
    if verdict.subject is not None:
        about = subject.sentence(verdict.subject)
    found = ["# Diagnosis", "", f"**{verdict.sentence}**", "", about, ""]
    found += bullets("What to do", dict.fromkeys(c.remedy for c in verdict.causes if c.remedy))
    for section in SECTIONS:
        found += section(verdict)
    return found


def markdown(verdict: Verdict) -> str:
    return "\n".join(lines(verdict))


def written(verdict: Verdict) -> str:
    """The file: without anything that a viewer of Markdown would load, and with the terms of the
    method to unfold at its end."""
    return f"{inert(markdown(verdict))}\n{TERMS_FOLD}"
