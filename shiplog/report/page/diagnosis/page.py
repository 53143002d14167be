"""The page of a verdict: a line a section, in their order."""

from __future__ import annotations

from pathlib import Path

from shiplog.exceptions import listed
from shiplog.report.diagnosis.sections.subject import MOST_VOYAGES, dates
from shiplog.report.page.blocks import Page, Section
from shiplog.report.page.diagnosis import (
    answer,
    causes,
    considered,
    coverage,
    execution,
    forces,
    prediction,
    provenance,
    record_next,
    since_when,
    stretches,
    terms,
    where,
)
from shiplog.report.page.diagnosis.source import Source, read

SECTIONS = (  # anchor, heading, blocks
    ("answer", "The answer", answer.blocks),
    ("where", "Where it shows", where.blocks),
    ("causes", "Causes and the extended model", causes.blocks),
    ("since", "Since when", since_when.blocks),
    ("prediction", "Prediction", prediction.blocks),
    ("forces", "The force that the model misses", forces.blocks),
    ("considered", "What was considered", considered.blocks),
    ("stretches", "Stretches", stretches.blocks),
    ("coverage", "Training and trial", coverage.blocks),
    ("next", "What to record next", record_next.blocks),
    ("execution", "Execution", execution.blocks),
    ("terms", "Terms", terms.blocks),
    ("provenance", "Provenance", provenance.blocks),
)
WORDS = {  # verdict → its word, its tone
    "named": ("cause named", "found"),
    "none": ("no change found", "good"),
    "unknown": ("outside the catalogue", "open"),
    "undecided": ("undecided", "open"),
    "coverage": ("not measured here", "open"),
    "external": ("pushed or towed", "open"),
}


def of_folder(folder: Path) -> Page:
    """The page of what `diagnose` wrote. Raises ShiplogError."""
    return of_source(read(folder))


def of_source(source: Source) -> Page:
    subject = source.subject
    word, tone = WORDS.get(source.word, (source.word, "open"))
    names = listed((one["name"] for one in subject["voyages"]), most=MOST_VOYAGES)
    when = dates([one["start"] for one in subject["voyages"]])
    return Page(
        title=f"{subject['ship']}: {word}",
        kicker=f"{subject['ship']}, {subject['length_m']:g} m · {names} · {when} · model "
        f"{subject['run']} · shiplog {subject['shiplog']}",
        word=word,
        tone=tone,
        claim=answer.claim(source),
        sections=[Section(name, title, blocks(source)) for name, title, blocks in SECTIONS],
    )
