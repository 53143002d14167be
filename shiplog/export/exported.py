"""A target's file: written, loaded again by its consumer, compared; and what is not in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shiplog.exceptions import ShiplogError
from shiplog.export import given_simulator
from shiplog.export.job import Job
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.targets import NUMBERS, PREDICTIONS, Target
from shiplog.export.trial import SAME, Difference
from shiplog.machine import files
from shiplog.nomenclature.channels import STATE
from shiplog.nomenclature.contract import CONTRACT
from shiplog.report.result import Printed

UNITS = {c.name: c.unit for c in STATE}


@dataclass(frozen=True, repr=False)
class Exported(Printed):
    """difference   from what shiplog itself says; None where its consumer did not load it
    unloaded     why it did not
    size         bytes
    losses       what of the run is not in it
    """

    run: str
    to: str
    target: Target
    path: Path
    consumer: str
    version: str
    difference: Difference | None
    unloaded: str
    size: int
    losses: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether it says what `simulate` says, as far as it was loaded."""
        return self.difference is None or not self.target.exact or self.difference.same

    @property
    def record(self) -> list[str]:
        return record(self.target, self.consumer, self.version, self.difference, self.unloaded)

    @property
    def lines(self) -> list[str]:
        found = [f"{self.run} as {self.to}: {self.path}, {size(self.size)}.", *self.record]
        if not self.complete:
            found.append(
                f"It is not the same model: rounding makes less than {SAME:g}. Report it, please."
            )
        if self.losses:
            found += ["", "Not in it:", *(f"- {line}" for line in self.losses)]
        return found

    @property
    def json(self) -> dict:
        known = self.difference
        return {
            "contract": CONTRACT, "run": self.run, "to": self.to, "path": str(self.path),
            "size_bytes": self.size, "consumer": self.consumer, "consumer_version": self.version,
            "loaded": known is not None, "not_loaded_because": self.unloaded or None,
            "greatest_difference": None if known is None else known.greatest,
            "differences": None if known is None else known.by_channel,
            "seconds": None if known is None else known.seconds,
            "not_in_it": list(self.losses),
        }  # fmt: skip


def size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 1e6 else f"{max(count / 1e3, 0.1):.1f} kB"


def record(
    target: Target, consumer: str, version: str, known: Difference | None, unloaded: str
) -> list[str]:
    """What is said of the comparison, and kept in the file."""
    if known is None:
        return [f"Not loaded by its consumer, {consumer}: {unloaded}."]
    program = f"{consumer} {version}".strip()
    apart = ", ".join(
        f"{name} {value:.2g} {UNITS.get(name, '')}".strip()
        for name, value in known.by_channel.items()
    )
    if target.kind == NUMBERS:
        return [f"Read again by {program}: its numbers differ by {known.greatest:.2g} at most."]
    if target.kind == PREDICTIONS:
        return [f"Read again by {program}: it differs by {known.greatest:.2g} at most ({apart})."]
    return [
        f"Sailed again by {program}: greatest difference from shiplog simulate over "
        f"{known.seconds:.0f} s {known.greatest:.2g} ({apart})."
    ]


def export(job: Job, to: str, target: Target, path: Path) -> Exported:
    """Raises ShiplogError for what the target cannot express, and where it cannot be written."""
    maker = target.maker
    given_simulator.refuse_unwritable(
        job.run, to, target.kind == PREDICTIONS or (target.of_voyages and bool(job.voyages))
    )
    losses = maker.losses(job)
    known, unloaded = None, ""
    with files.temporary_folder() as folder:
        first = folder / path.name
        _writing(lambda: maker.write(job, first, []), path)
        try:
            known = maker.compare(job, first)
        except NotLoaded as error:
            unloaded = str(error)
    kept = record(target, maker.CONSUMER, maker.version(), known, unloaded)
    _writing(lambda: maker.write(job, path, kept), path)
    return Exported(
        job.run.name, to, target, path, maker.CONSUMER, maker.version(), known, unloaded,
        path.stat().st_size, losses,
    )  # fmt: skip


def _writing(write: Callable[[], Any], path: Path) -> None:
    try:
        write()
    except OSError as error:
        raise ShiplogError(
            f"{path} could not be written: {error.strerror or error}.",
            hint="is the disk full, is the folder writable?",
        ) from error
