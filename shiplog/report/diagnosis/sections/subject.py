"""What a verdict is about: ship, voyages, run, program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

import polars as pl

from shiplog.exceptions import listed
from shiplog.report.evaluation import derived
from shiplog.ship_profile.profile import Profile
from shiplog.training.runs.load_model import Run

MOST_VOYAGES = 3  # with their names in a sentence; the others are counted


@dataclass(frozen=True, slots=True)
class JudgedVoyage:
    """A voyage that was judged.

    start    ISO 8601, UTC
    seconds  that could be used
    """

    name: str
    start: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Subject:
    """What the verdict is about.

    length_m    of the ship
    run         name of the run
    model       what kind of model it is, in words
    made        what it was fitted to
    trained_on  voyages that it was fitted to
    voyages     that were judged, with `name`, `start` (ISO 8601, UTC), `seconds`
    window_s    length of a window
    derived     what was measured and what was derived, where not all was measured
    shiplog     version of the program
    """

    ship: str
    length_m: float
    run: str
    model: str
    made: str
    trained_on: tuple[str, ...]
    voyages: tuple[JudgedVoyage, ...]
    window_s: int
    shiplog: str
    derived: str = ""


def of(run: Run, made: str, profile: Profile, voyages: pl.DataFrame) -> Subject:
    """`voyages`: as `PictureData` has them."""
    judged = tuple(
        JudgedVoyage(*row) for row in voyages.select("voyage", "start", "seconds").iter_rows()
    )
    return Subject(
        profile.ship.name, float(profile.ship.length_m), run.name, run.label, made,
        tuple(run.trained_on), judged, run.config.window, version("shiplog"),
        derived.of_profile(profile),
    )  # fmt: skip


def dates(starts: Sequence[str]) -> str:
    """The first and the last day of ISO stamps: "2026-04-14", "2026-04-14 to 2026-04-16"."""
    days = sorted(start[:10] for start in starts)
    if not days:
        return ""
    if days[0].startswith("1970"):  # seconds of a recorder that knows no date
        return "without a date"
    return days[0] if days[0] == days[-1] else f"{days[0]} to {days[-1]}"


def begin(start: str) -> str:
    """Day and minute of an ISO stamp; of a recorder that knows no date, nothing that looks like
    one."""
    return "without a date" if start.startswith("1970") else start[:16].replace("T", " ")


def sentence(subject: Subject) -> str:
    """Who, on what, when: the head of a page."""
    names = listed((v.name for v in subject.voyages), most=MOST_VOYAGES)
    when = dates([v.start for v in subject.voyages])
    seconds = sum(v.seconds for v in subject.voyages)
    measured = f" {subject.derived}" if subject.derived else ""
    return (
        f"Ship: {subject.ship}, {subject.length_m:g} m. Voyages: {names} ({when}, "
        f"{seconds:.0f} s). Model: {subject.run}, {subject.made}. shiplog {subject.shiplog}."
        f"{measured}"
    )
