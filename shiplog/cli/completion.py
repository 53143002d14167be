"""What a shell completes: voyages of a store, run folders, profiles, words of options.

A completion reads names of folders and nothing else, so that it takes the time of `shiplog --help`;
whatever goes wrong, it completes nothing. Where it has no answer the shell completes file names.

A shell puts a completion on the command line as it is. Names may be strangers', so that one with a
letter that means something to a shell is left out: it has to be typed, in quotes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

import typer

INERT = re.compile(r"[\w./,:@%+=-]+")  # a name that means nothing else to any shell
MOST_FOLDERS = 500  # looked into for runs

Completer = Callable[[str], list[str]]


def of_words(words: Iterable[str]) -> Completer:
    """An option that takes one of these words."""
    known = tuple(words)

    def complete(incomplete: str) -> list[str]:
        return [word for word in known if word.startswith(incomplete)]

    return complete


def voyages(ctx: typer.Context, incomplete: str) -> list[str]:
    """Names of the voyages in --store."""
    from shiplog.voyages.store import catalogue

    store = Path(ctx.params.get("store") or "store")
    try:
        names = sorted(catalogue.name_of(path) for path in store.glob("voyage=*"))
    except OSError:
        return []
    return [name for name in names if name.startswith(incomplete) and INERT.fullmatch(name)]


def runs(incomplete: str) -> list[str]:
    """Run folders whose path begins so, or that are in a folder whose path does."""
    head, slash, begin = incomplete.rpartition("/")
    found = []
    for folder in _folders(Path(head + slash or "."), begin):
        inside = [folder] if _is_run(folder) else [f for f in _folders(folder, "") if _is_run(f)]
        found += [str(one) for one in inside]
    return sorted(name for name in found if INERT.fullmatch(name))


def profiles(incomplete: str) -> list[str]:
    """Names of the shipped profiles."""
    folder = Path(__file__).parents[1] / "profiles"
    names = sorted(p.stem for p in folder.glob("*.toml") if "." not in p.stem)  # not NAME.mmg.toml
    return [name for name in names if name.startswith(incomplete)]


def _folders(parent: Path, begin: str) -> list[Path]:
    """Folders of `parent` whose names begin so, hidden and unfinished ones left out."""
    try:
        every = [p for p in parent.iterdir() if p.name.startswith(begin) and p.name[:1] != "."]
        return [p for p in sorted(every)[:MOST_FOLDERS] if p.is_dir() and p.suffix != ".partial"]
    except OSError:
        return []


def _is_run(folder: Path) -> bool:
    try:
        return (folder / "config.toml").is_file()
    except OSError:
        return False
