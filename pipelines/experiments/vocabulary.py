"""Words that the glossary replaces by the field's own: how often each folder still has them.

    python -m pipelines.experiments.vocabulary [COMMIT]

Counts Python and Markdown files of the working tree, or of COMMIT, and prints a Markdown table.
A word counts in identifiers, docstrings, comments and messages; with --text not in identifiers.
--lines FOLDER prints each line instead.
"""

from __future__ import annotations

import argparse
import io
import re
import subprocess
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from shiplog.report.evaluation import tables

ROOT = Path(__file__).parents[2]
WORDS = {  # word: pattern; a word ends where its letters end, so that `known_unrest` has one
    "unrest": "unrest",
    "push": "push|pushes|pushed|pushing",
    "louder": "loud|louder|loudness",
    "beside, besides": "besides?",
    "told": "told",
    "said": "said",
    "shown": "shown",
    "seen": "seen",
    "usual": "usual|usually",
    "settled": "settled?|settles|settling",
    "stands off, aslant": r"stands? off|aslant",
    "what is left, what it lacks": r"what is left|what it lacks",
    "nats that it brings": r"nats that|brings?",
    "poses": r"poses",
    "is asked": r"(is|are|was|were) asked",
    "takes in": r"takes? (it |that |them )?in|took in|taken in",
    "rests": "rests",
    "runs away": r"(runs?|ran|running|that) away",
    "pulses": r"pulses?",
    "floors": r"floors?(?!\()",
    "learned from": r"learned (from|of|on)",
    "made on": r"made[ _]on",
}
FOLDERS = (
    "shiplog/nomenclature", "shiplog/machine", "shiplog/ship_profile", "shiplog/logs",
    "shiplog/voyages", "shiplog/drafting", "shiplog/models", "shiplog/simulation",
    "shiplog/training", "shiplog/diagnosis", "shiplog/report", "shiplog/commands", "shiplog/cli",
    "shiplog", "pipelines/experiments", "pipelines", "tests", "docs",
)  # fmt: skip
TEXTS = (".py", ".md")


def pattern(word: str) -> re.Pattern:
    return re.compile(rf"(?<![A-Za-z])(?:{WORDS[word]})(?![A-Za-z])", re.IGNORECASE)


def folder(path: str) -> str:
    """The first of FOLDERS that holds a file; files of the top folder count as `docs`."""
    return next((name for name in FOLDERS if path.startswith(f"{name}/")), "docs")


def texts(commit: str | None) -> Iterator[tuple[str, str]]:
    """Path and text of every file that git tracks, but this one and the changelog."""
    listed = _git("ls-tree", "-r", "--name-only", commit) if commit else _git("ls-files")
    for path in listed.splitlines():
        if path.endswith(TEXTS) and Path(path).name not in (Path(__file__).name, "CHANGELOG.md"):
            here = ROOT / path
            if commit:
                yield path, _git("show", f"{commit}:{path}")
            elif here.is_file():
                yield path, here.read_text(encoding="utf-8")


def prose(path: str, text: str) -> str:
    """Comments, docstrings and messages of a Python file, without names in backticks."""
    if not path.endswith(".py"):
        return text
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    kept = [
        token.string
        for token in tokens
        if token.type == tokenize.COMMENT or (token.type == tokenize.STRING and " " in token.string)
    ]
    return re.sub(r"`[^`]*`|\{[^}]*\}", " ", "\n".join(kept))


def counts(commit: str | None, only_text: bool = False) -> dict[str, Counter]:
    """Folder → word → how often it is there."""
    found = {name: Counter() for name in FOLDERS}
    for path, whole in texts(commit):
        text = prose(path, whole) if only_text else whole
        for word in WORDS:
            found[folder(path)][word] += len(pattern(word).findall(" ".join(text.split())))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("commit", nargs="?")
    parser.add_argument("--text", action="store_true", help="without identifiers")
    parser.add_argument("--lines", metavar="FOLDER", help="each line below this folder instead")
    given = parser.parse_args()
    if given.lines:
        for path, text in texts(given.commit):
            if path.startswith(given.lines):
                for i, line in enumerate(text.splitlines(), 1):
                    words = [word for word in WORDS if pattern(word).search(line)]
                    if words:
                        print(f"{path}:{i}: {line.strip()}")
        return
    found = counts(given.commit, given.text)
    rows = [
        (word, *(found[name][word] for name in FOLDERS), sum(c[word] for c in found.values()))
        for word in WORDS
    ]
    rows.append(("all", *(found[name].total() for name in FOLDERS), sum(r[-1] for r in rows)))
    print(tables.table(("word", *FOLDERS, "all"), rows))


def _git(*words: str) -> str:
    return subprocess.run(
        ["git", "-C", str(ROOT), *words], check=True, capture_output=True, text=True
    ).stdout


if __name__ == "__main__":
    main()
