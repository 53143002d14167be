"""All that an alarm needs of a run: directions, tails, median; worked out once and kept."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shiplog.diagnosis.linear import segments
from shiplog.live import alarm_threshold, change_evidence, left_out, segment_products
from shiplog.live.alarm import LASTING, Thresholds, Watcher, lasting_squares, places
from shiplog.live.alarm_threshold import Tail, peaks_of, tail_of
from shiplog.live.change_evidence import ChangeEvidence
from shiplog.live.nominal import Nominal
from shiplog.live.segment_products import Directions
from shiplog.machine import disk_cache, files

FOLDER = "watched"
KEPT = ("change", "square", "voyage")


@dataclass(frozen=True)
class Calibration:
    """median  χ̃² of the campaign's segments; tails of log Z_n and of the lasting log χ²_s/χ̃²"""

    directions: Directions
    median: float
    tails: tuple[Tail, Tail]
    segment_s: float

    def watcher(self, per_day: float) -> Watcher:
        """A watch that is wrong so many times a day."""
        thresholds = Thresholds.of(self.tails, per_day, self.segment_s)
        return Watcher(self.directions, thresholds, self.median)

    @property
    def identity(self) -> str:
        """Of a kept watch, whether it was of this campaign."""
        digest = hashlib.sha256(self.directions.mean.tobytes())
        digest.update(self.directions.of_part.tobytes() + self.directions.of_all.tobytes())
        return digest.hexdigest()


def calibrated(nominal: Nominal) -> Calibration:
    """Of a nominal campaign, each voyage of it watched with what the others say. Raises
    np.linalg.LinAlgError."""
    directions = segment_products.directions(nominal.campaign)
    median, tails = tails_of(watched(nominal, directions))
    return Calibration(directions, median, tails, nominal.grid.seconds)


def watched(nominal: Nominal, directions: Directions) -> dict[str, np.ndarray]:
    """The nominal voyages, each watched with what the others say: log Z_n (`change`) and χ²_s
    (`square`) of every segment and its `voyage` [S]; worked out once for a campaign."""
    kept = _place(nominal, directions)
    known = _read(kept)
    if known is None:
        known = _watched(nominal)
        _keep(kept, known)
    return known


def _watched(nominal: Nominal) -> dict[str, np.ndarray]:
    campaign = nominal.campaign
    rows = segments.begins(nominal.record)
    grams = segment_products.grams(campaign.reference, nominal.grid, nominal.record, rows)
    of = nominal.record.voyage[rows]
    found: list[tuple[float, float, int]] = []
    for voyages, others in left_out.folds(campaign, of):
        directions = segment_products.directions(others)
        for number in voyages.tolist():
            evidence = ChangeEvidence(directions.widths, places(directions.causes))
            for gram in (grams[i] for i in np.flatnonzero(of == number)):
                if gram[0, 0] <= 0.0:  # the model diverged on it
                    continue
                product = directions.products(gram)
                square = change_evidence.unexplained(product, directions.counts)
                weight = change_evidence.weight(evidence.alone(product))
                found.append((evidence.add(weight * product).total, square, number))
    change, squares, voyage = np.array(found, float).reshape(-1, 3).T
    return {"change": change, "square": squares, "voyage": voyage.astype(int)}


def tails_of(known: Mapping[str, np.ndarray]) -> tuple[float, tuple[Tail, Tail]]:
    """Of `watched` voyages χ̃², and what is known of the next values of the two statistics. Raises
    ValueError where they are too few."""
    median = float(np.median(known["square"]))
    logs = np.log(np.maximum(known["square"], 1e-9) / median)
    each = [known["voyage"] == number for number in np.unique(known["voyage"])]
    change, per = peaks_of([known["change"][here] for here in each])
    lasting, few = peaks_of([lasting_squares(logs[here]) for here in each], LASTING)
    if len(lasting) < 2:  # voyages of a few segments: single ones are further out
        lasting, few = logs, 1.0
    count = len(logs)
    return median, (
        tail_of(change, per, count, alarm_threshold.CHANGE),
        tail_of(lasting, few, count, alarm_threshold.UNEXPLAINED),
    )


def _place(nominal: Nominal, directions: Directions) -> Path:
    digest = hashlib.sha256(disk_cache.source())
    for array in (directions.mean, directions.of_part, directions.of_all, nominal.record.state,
                  nominal.record.actuator, nominal.record.wind):  # fmt: skip
        digest.update(np.ascontiguousarray(array).tobytes())
    return disk_cache.folder() / FOLDER / f"{digest.hexdigest()}.npz"


def _read(path: Path) -> dict[str, np.ndarray] | None:
    try:
        with np.load(path, allow_pickle=False) as arrays:
            found = {name: arrays[name] for name in KEPT}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return found if all(np.isfinite(values).all() for values in found.values()) else None


def _keep(path: Path, found: Mapping[str, np.ndarray]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with files.whole(path) as partial, partial.open("wb") as stream:
            np.savez(stream, **dict(found))  # pyright: ignore[reportArgumentType]
    except OSError:  # a cache that cannot be written is no fault
        return
