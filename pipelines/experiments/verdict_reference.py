"""The keys of a verdict in docs/reference/answers.md, from the dataclasses that are written.

python -m pipelines.experiments.verdict_reference --markdown docs/reference/answers.md
"""

from __future__ import annotations

import argparse
import inspect
import re
from dataclasses import fields
from pathlib import Path

from shiplog.diagnosis.residual.interval import Interval
from shiplog.report.diagnosis.sections.causes import NamedCause
from shiplog.report.diagnosis.sections.contradictions import Contradiction
from shiplog.report.diagnosis.sections.gain import HeldOutGain
from shiplog.report.diagnosis.sections.limits import Limit, NotShown
from shiplog.report.diagnosis.sections.ranking import Ranked
from shiplog.report.diagnosis.sections.reasons import Reason
from shiplog.report.diagnosis.sections.structure import Structure
from shiplog.report.diagnosis.sections.subject import Subject
from shiplog.report.diagnosis.sections.traces import Trace
from shiplog.report.diagnosis.sections.unseen import Omitted
from shiplog.report.diagnosis.sections.wrong import ChannelError
from shiplog.report.diagnosis.verdict import Base

BEGIN, END = "### `diagnose --json` and `verdict.json`", "The names of causes and their parameters"
WORDS = "`named`, `none`, `unknown`, `undecided`, `coverage` or `external`"
# Key → what it holds: a dataclass, whose docstring says what of, or a sentence.
KEYS: dict[str, type | str] = {
    "verdict": f"{WORDS}; [reading a verdict](../use/reading_a_verdict.md) has their meaning",
    "sentence": "the answer in words",
    "causes": NamedCause,
    "ranking": Ranked,
    "rejected": Reason,
    "unavailable": Reason,
    "traces": Trace,
    "structure": Structure,
    "explained": "share of the held-out error that the named causes take away; 0 where none is",
    "gain": HeldOutGain,
    "wrong": ChannelError,
    "unseen": Omitted,
    "limits": Limit,
    "not_shown": NotShown,
    "contradictions": Contradiction,
    "intervals": Interval,
    "notes": "sentences on the model and the data",
    "base": Base,
    "subject": Subject,
    "recording": "of the command, not in the file: the path of `diagnosis.rrd`",
}
# Of a class that two keys share, what each of them is.
SHARED = {"rejected": "causes that are not named", "unavailable": "causes that are not testable"}


def section() -> str:
    """Markdown, from the heading to the end of the table."""
    rows = [f"| `{key}` | {_content(key, of)} |" for key, of in KEYS.items()]
    return "\n".join([BEGIN, "", "| key | content |", "| --- | --- |", *rows, ""])


def page(whole: str) -> str:
    """The page of formats with this section in its place."""
    head, _, rest = whole.partition(BEGIN)
    return f"{head}{section()}\n{END}{rest.partition(END)[2]}"


def _content(key: str, of: type | str) -> str:
    if isinstance(of, str):
        return of
    meaning, of_fields = documented(of)
    named = [
        f"`{one.name}`" + (f" ({of_fields[one.name]})" if one.name in of_fields else "")
        for one in fields(of)
    ]
    about = SHARED.get(key, meaning.removesuffix("."))
    return f"{about[0].lower()}{about[1:]}: {', '.join(named)}"


def documented(of: type) -> tuple[str, dict[str, str]]:
    """What a dataclass's docstring says of it, and of its fields."""
    meaning, _, rest = inspect.getdoc(of).partition("\n\n")  # type: ignore[union-attr]
    found: dict[str, str] = {}
    for line in rest.splitlines():
        if begun := re.match(r"(\w+)  +(\S.*)", line):
            found[name := begun[1]] = begun[2]
        elif line.strip():
            found[name] += f" {line.strip()}"
    return " ".join(meaning.split()), found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--markdown", type=Path, required=True, metavar="PATH")
    path = parser.parse_args().markdown
    path.write_text(page(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
