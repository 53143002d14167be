"""The page docs/science/thresholds.md, from the numbers and comments of the program itself.

python -m pipelines.experiments.site.rules --markdown docs/science/thresholds.md
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from shiplog.diagnosis import thresholds
from shiplog.report.evaluation import tables

ENTRY = re.compile(r"((?:^# [^\n]*\n)+)^([A-Z_]+) = ", re.MULTILINE)
SECTION = re.compile(r"^# --- (.*)$", re.MULTILINE)
HEAD = """# Thresholds

Every number that decides between verdicts, with its unit and reason, as it stands in
`shiplog/diagnosis/thresholds.py`; this page is written from that file by `python -m
pipelines.experiments.site.rules`. [Rules](rules.md) says where each one is applied. Settings of one
method, such as how the pattern of an on-off force is read, are at the top of its module.
"""


def text() -> str:
    """The whole page: a table a section."""
    source = Path(thresholds.__file__).read_text(encoding="utf-8")
    _, *pieces = SECTION.split(source)
    parts = [HEAD]
    for title, body in zip(pieces[::2], pieces[1::2], strict=True):
        rows = [
            (f"`{name}`", f"{getattr(thresholds, name):.3g}", _sentences(comment))
            for comment, name in ENTRY.findall(body)
        ]
        table = tables.table(("name", "value", "unit, and reason"), rows)
        parts += [f"## {title[0].upper()}{title[1:]}\n", f"{table}\n"]
    return "\n".join(parts)


def _sentences(comment: str) -> str:
    return " ".join(line.removeprefix("# ") for line in comment.strip().splitlines())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--markdown", type=Path, default=Path("docs/science/thresholds.md"))
    parser.parse_args().markdown.write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    main()
