"""The table of all data sets; and a page a ship, which begins with its answers and a judgement.

What stands between the marks of a ship's page is written here; the rest of the page is kept.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

from pipelines.experiments.measured_ships.judgements import JUDGEMENTS
from pipelines.experiments.measured_ships.ships import DATA_SETS
from pipelines.experiments.measured_ships.way import Way
from shiplog.report.evaluation import tables
from shiplog.voyages.rows.one_hertz import WINDOW

WIDTH = 100  # letters of a line
HEAD = """# Measured ships, from their files to a verdict

    python -m pipelines.experiments.measured_ships DATA --out measured \\
        --markdown docs/evidence/measured_ships.md

Each data set is treated as its owner would treat it: a profile (shipped, or drafted and completed
where it says CHECK), `convert`, `ingest`, `train --model mmg`, `evaluate`, and `diagnose` on the
voyages that were not trained on. It ends with a verdict, or with what these data lack for one.
None of the data are part of this repository. L is the paper's loss
([glossary](../science/glossary.md)); the baselines hold the velocity, and fit a quadratic by
least squares to the training voyages. Where that one has a *, the training voyages are among
those that L is of. The split of the voyages is shiplog's and not the published one, so that L is
not comparable with that of other pages. One file of the Esso Osaka repeats the beginning of
another; it is included here, which gives 121 windows instead of 119.

*Explained* is the share of the error on held-out windows that the named causes take away. Each
ship's page begins with its answer, and with the authors' judgement of it.
"""
# Page → its title, and the data sets on it.
PAGES: dict[str, tuple[str, tuple[str, ...]]] = {
    "esso_osaka": ("Esso Osaka, 3 m", ("esso-osaka", "esso-osaka, published")),
    "kvlcc2": ("KVLCC2: HSVA's model, and MARIN's", ("kvlcc2", "kvlcc2, full scale")),
    "blueboat": ("BlueBoat, 1.2 m", ("blueboat",)),
    "milliampere": ("milliAmpere, 5 m ferry", ("milliampere",)),
    "another_simulator": ("3 m ship of another simulator", ("other_ship",)),
    "usv": ("Two unmanned surface vehicles", ("usv_fuzhou", "qixing")),
    "ferries": ("Ferries and a container ship at 1 Hz", ("tycho-brahe", "aurora", "hakusan")),
    "cybership": ("CyberShip Enterprise I, 1.1 m", ("cybership",)),
    "recorders": ("A spreadsheet, and two yachts' instruments", ("dalian", "aava", "merrimac")),
    "other_logs": (
        "Logs that are not of one ship", ("mcap, location", "mcap, battery", "mcap, AIS"),
    ),
}  # fmt: skip
BEGIN, END = "<!-- answers: written by measured_ships -->", "<!-- end of answers -->"
MARKED = re.compile(f"{re.escape(BEGIN)}.*{re.escape(END)}", re.DOTALL)


def text(ways: Sequence[Way]) -> str:
    """The table of all."""
    head = (
        "ship", "voyages", "usable, s", "windows of 100 s", "window of L, s", "L", "L of hold",
        "L of least squares", "verdict", "explained", "processor time of all commands, s",
    )  # fmt: skip
    listed = (f"- [{title}]({name}.md)" for name, (title, _) in PAGES.items())
    return "\n".join(
        (
            HEAD,
            tables.table(head, [_row(one) for one in ways]),
            "",
            "A page a ship:",
            "",
            *listed,
            "",
        )
    )


def answers(ways: Sequence[Way]) -> str:
    """What a ship's page begins with: the answer of each of its data sets, and the judgement."""
    parts = [BEGIN]
    for one in ways:
        parts += [f"## {DATA_SETS[one.name].ship}: the answer", _answer(one)]
        parts += [_filled(JUDGEMENTS[one.name])] if one.name in JUDGEMENTS else []
    return "\n\n".join((*parts, END))


def write(path: Path, ways: Sequence[Way]) -> None:
    """The table, and the pages of ships in its folder."""
    path.write_text(text(ways), encoding="utf-8")
    for name, (title, of) in PAGES.items():
        there = path.with_name(f"{name}.md")
        before = there.read_text("utf-8") if there.exists() else f"# {title}\n\n{BEGIN}{END}\n"
        if chosen := [one for one in ways if one.name in of]:
            new = answers(chosen)
            there.write_text(MARKED.sub(lambda _, new=new: new, before), encoding="utf-8")


def _row(one: Way) -> tuple[object, ...]:
    evaluated, verdict = one.answers.get("evaluate"), one.answers.get("diagnose")
    usable = sum(v["usable_s"] or 0 for v in one.voyages)
    windows = sum(v["windows"] or 0 for v in one.voyages)
    losses: tuple[object, ...] = ("-", "-", "-", "-")
    if evaluated:
        floors = evaluated["floors"]
        given = DATA_SETS[one.name].train
        window = given[given.index("--window") + 1] if "--window" in given else str(WINDOW)
        each = (evaluated["loss"], floors["hold"], floors["least_squares"])
        model, hold, regressed = (_number(x) for x in each)
        mark = " *" if DATA_SETS[one.name].in_sample else ""
        losses = (window, model, hold, f"{regressed}{mark}")
    reported, explained = "-", "-"
    if verdict:
        named = ", ".join(dict.fromkeys(c["name"] for c in verdict["causes"]))
        family = (verdict.get("structure") or {}).get("family")
        reported = named or ": ".join(filter(None, (verdict["verdict"], family)))
        explained = f"{verdict.get('explained') or 0.0:.0%}"
    elif one.stopped:
        reported = "no diagnosis"
    counted = (len(one.voyages), usable, windows) if one.voyages else ("-", "-", "-")
    return (DATA_SETS[one.name].ship, *counted, *losses, reported, explained, f"{one.cpu_s:.0f}")


def _number(value: float | None) -> str:
    """A loss of an answer, whose JSON has no infinity."""
    return "diverged" if value is None else f"{value:.0f}"


def _answer(one: Way) -> str:
    """A quotation: a message and its hint are a paragraph each."""
    verdict = one.answers.get("diagnose")
    given = verdict["sentence"] if verdict and not one.stopped else one.stopped
    return "\n>\n".join(_filled(paragraph, "> ") for paragraph in given.splitlines())


def _filled(paragraph: str, before: str = "") -> str:
    """In lines of a page's width, each with `before` in front."""
    return textwrap.fill(
        paragraph, WIDTH, initial_indent=before, subsequent_indent=before, break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip
