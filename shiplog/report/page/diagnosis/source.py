"""What the page of a verdict is made of: the folder that `diagnose` wrote, and nothing else."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shiplog.exceptions import ShiplogError
from shiplog.nomenclature.contract import CONTRACT
from shiplog.report.figures import picture_data
from shiplog.report.figures.content import Content
from shiplog.report.page import drawing
from shiplog.report.page.blocks import Drawn

VERDICT, PROVENANCE, GATE = "verdict.json", "provenance.json", "gate.json"
NEEDED = (  # keys of a verdict that the page is made of
    "verdict", "sentence", "causes", "ranking", "rejected", "traces", "wrong", "intervals",
    "unseen", "limits", "unavailable", "notes", "contradictions", "base", "subject",
)  # fmt: skip
OF_SUBJECT = ("ship", "length_m", "run", "voyages", "window_s", "shiplog")


@dataclass(frozen=True)
class Source:
    """A verdict, the tables of its pictures, where it comes from, and what the gate said of it;
    None where it was not asked."""

    content: Content
    provenance: Mapping[str, Any]
    gate: Mapping[str, Any] | None = None

    @property
    def verdict(self) -> Mapping[str, Any]:
        return self.content.verdict

    @property
    def subject(self) -> Mapping[str, Any]:
        return self.verdict["subject"]

    @property
    def word(self) -> str:
        return str(self.verdict["verdict"])

    def gallery(self, names: Sequence[str], voyage: str | None = None) -> list[Drawn]:
        """Those of these pictures that have something to draw."""
        return drawing.gallery(self.content, names, voyage)


def is_verdict(folder: Path) -> bool:
    """Whether `diagnose` wrote this folder."""
    return (folder / VERDICT).is_file()


def read(folder: Path) -> Source:
    """Raises ShiplogError for a folder without a verdict, or with one of another contract."""
    verdict = _json(folder / VERDICT)
    if verdict.get("contract") != CONTRACT or "verdict" not in verdict:
        raise ShiplogError(
            f"{folder / VERDICT} is no verdict of contract {CONTRACT}, but of "
            f"{verdict.get('contract')!r}.",
            hint="diagnose again with this version.",
        )
    if "subject" not in verdict or not (folder / picture_data.FOLDER).is_dir():
        raise ShiplogError(
            f"{folder} was written by an earlier shiplog: it does not have what a page needs.",
            hint="diagnose again into a new folder.",
        )
    subject = verdict["subject"] if isinstance(verdict["subject"], dict) else {}
    missing = [key for key in NEEDED if key not in verdict]
    if missing := missing + [f"subject.{key}" for key in OF_SUBJECT if key not in subject]:
        raise ShiplogError(
            f"{folder / VERDICT} is not whole: it does not have {', '.join(missing)}.",
            hint="diagnose again into a new folder.",
        )
    try:
        provenance = _json(folder / PROVENANCE)
    except ShiplogError:
        provenance = {}
    data = picture_data.load(folder / picture_data.FOLDER)
    gate = None
    if (folder / GATE).is_file():
        gate = _json(folder / GATE, "ask `shiplog gate` again, or take the file away.")
    return Source(Content(verdict, data), provenance, gate)


def _json(path: Path, again: str = "diagnose again into a new folder.") -> dict:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(found, dict):
            raise ValueError("it is no object")
    except FileNotFoundError:
        raise ShiplogError(
            f"{path.parent} has no {path.name}.",
            hint="give the folder that `shiplog diagnose` wrote (--out).",
        ) from None
    except (OSError, ValueError) as error:
        raise ShiplogError(f"{path} cannot be read: {error}.", hint=again) from error
    return found
