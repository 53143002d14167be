"""What a page consists of. A page is made of sections, a section of blocks; `html` renders them.

Texts are plain: what they hold of a stranger's is escaped where the page is rendered. A number that
stands in the JSON of a result is a `Number`, so that a reader, and a test, finds its value.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field

from shiplog.diagnosis.thresholds import STATED
from shiplog.nomenclature.numbers import figure, percent


@dataclass(frozen=True, slots=True)
class Number:
    """A value of the JSON, and how it is written."""

    value: float
    text: str


Part = str | Number
Line = Sequence[Part]  # a line of text, part by part


def number(value: float, unit: str = "", digits: int = 3) -> Number:
    """With a thin space before its unit; in per cent where the unit is "1"."""
    if unit == "1":
        return Number(value, f"{figure(100.0 * value, digits)}\u202f%")
    text = figure(value, digits)
    return Number(value, f"{text}\u202f{unit}" if unit else text)


def seconds(value: float) -> Number:
    """A time, or a length of time, to the tenth of a second: a recorder's stamps are no finer."""
    return Number(value, f"{value:.1f}".removesuffix(".0") + "\u202fs")


def share(value: float) -> Number:
    """A share as whole per cent."""
    return Number(value, percent(value))


def or_diverged(value: float | None, unit: str = "") -> Line:
    """A figure of an evaluation, which has none where the model diverged."""
    return ["diverged"] if value is None else [number(value, unit)]


def probability(value: float) -> Number:
    """With two decimals; what is too little to be named is not rounded up to that."""
    text = f"{value:.2f}"
    if value < STATED <= float(text):
        text = f"{math.floor(100.0 * value) / 100.0:.2f}"
    return Number(value, text)


@dataclass(frozen=True, slots=True)
class Paragraph:
    line: Line
    strong: bool = False


@dataclass(frozen=True, slots=True)
class Items:
    """A list of lines."""

    lines: Sequence[Line]


@dataclass(frozen=True, slots=True)
class Grid:
    """Rows of cells; a cell is a line. `right`: titles of the columns that are flush right."""

    head: Sequence[str]
    rows: Sequence[Sequence[Line]]
    right: Sequence[str] = ()
    title: str = ""


@dataclass(frozen=True, slots=True)
class Answers:
    """Questions with their answers, as cards."""

    pairs: Sequence[tuple[str, Sequence[Line]]]


@dataclass(frozen=True, slots=True)
class Drawn:
    """A picture: an `<svg>` of ours, what it shows in words, and its caption."""

    svg: str
    words: str
    caption: str
    wide: bool = False


@dataclass(frozen=True, slots=True)
class Gallery:
    """Pictures next to each other where there is room."""

    pictures: Sequence[Drawn]


@dataclass(frozen=True, slots=True)
class Equation:
    """As the catalogue has it, on a line of its own."""

    text: str


@dataclass(frozen=True, slots=True)
class Command:
    """To copy into a terminal."""

    text: str


def moment(runs: Sequence[str], store: str, voyage: str, seconds: float) -> Command:
    """Opens the comparison of runs at a moment of a voyage."""
    called = " ".join(shlex.quote(run) for run in runs)
    at = f"{voyage}:{seconds:.0f}".replace("'", "'\\''")
    return Command(f"shiplog compare {called} --store {shlex.quote(store)} --at '{at}'")


@dataclass(frozen=True, slots=True)
class Fold:
    """What a reader opens: closed on a screen, open in print."""

    title: str
    blocks: Sequence[Block]


Block = Paragraph | Items | Grid | Answers | Drawn | Gallery | Equation | Command | Fold


@dataclass(frozen=True, slots=True)
class Section:
    """A heading and its blocks; `name` is its anchor."""

    name: str
    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True, slots=True)
class Page:
    """title     of the window
    kicker    who, on what, when: the line above the claim
    word      the verdict, in a word or two; `tone` is its colour: `found`, `good`, `open`
    claim     the answer with its scope
    """

    title: str
    kicker: str
    word: str
    tone: str
    claim: str
    sections: Sequence[Section] = field(default=())
