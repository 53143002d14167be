"""All that an alarm needs of a run: directions, tails, median; worked out once and kept."""

from __future__ import annotations

import hashlib
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shiplog.diagnosis.linear import segments
from shiplog.live import alarm_threshold, change_evidence, segment_products
from shiplog.live.alarm import Thresholds, Watcher, places
from shiplog.live.alarm_threshold import Tail, peaks_of, tail_of
from shiplog.live.change_evidence import ChangeEvidence
from shiplog.live.nominal import Nominal
from shiplog.live.segment_products import Directions
from shiplog.machine import disk_cache, files

FOLDER = "watched"


@dataclass(frozen=True)
class Calibration:
    """median  χ̃² of the campaign's segments; tails of log Z_n and of log χ²_s/χ̃²"""

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
    """Of a nominal campaign, each voyage of it watched with what the others say."""
    directions = segment_products.directions(nominal.campaign)
    kept = _place(nominal, directions)
    known = _read(kept)
    if known is None:
        known = _made(nominal)
        _keep(kept, known)
    median, *numbers = known.tolist()
    change, other = (Tail(at, by, int(count)) for at, by, count in (numbers[:3], numbers[3:]))
    return Calibration(directions, median, (change, other), nominal.grid.seconds)


def watched_voyages(nominal: Nominal) -> tuple[list[list[float]], list[float]]:
    """log Z_n of each nominal voyage, and χ²_s of all segments."""
    campaign = nominal.campaign
    rows = segments.begins(nominal.record)
    grams = segment_products.grams(campaign.reference, nominal.grid, nominal.record, rows)
    of = nominal.record.voyage[rows]
    alike = len(campaign.voyages) == len(nominal.record.names)
    totals: list[list[float]] = []
    squares: list[float] = []
    for number in range(len(nominal.record.names)):
        if not (of == number).any():
            continue
        directions = segment_products.directions(campaign, number if alike else -1)
        evidence = ChangeEvidence(directions.widths, places(directions.causes))
        here: list[float] = []
        for gram in (grams[i] for i in np.flatnonzero(of == number)):
            if gram[0, 0] <= 0.0:  # the model diverged on it
                continue
            product = directions.products(gram)
            squares.append(change_evidence.unexplained(product, directions.counts))
            weight = change_evidence.weight(evidence.alone(product))
            here.append(evidence.add(weight * product).total)
        totals.append(here)
    return totals, squares


def _made(nominal: Nominal) -> np.ndarray:
    totals, squares = watched_voyages(nominal)
    median = float(np.median(squares))
    count = sum(map(len, totals))
    peaks = np.concatenate([peaks_of(one) for one in totals if one])
    change = tail_of(peaks, count, alarm_threshold.SCALE, alarm_threshold.OPTIMISM)
    logs = peaks_of(np.log(np.maximum(squares, 1e-9) / median).tolist())
    other = tail_of(logs, count, alarm_threshold.UNEXPLAINED_SCALE)
    numbers = [value for t in (change, other) for value in (t.location, t.scale, t.segments)]
    return np.array([median, *numbers], float)


def _place(nominal: Nominal, directions: Directions) -> Path:
    digest = hashlib.sha256(disk_cache.source())
    for array in (directions.mean, directions.of_part, directions.of_all, nominal.record.state,
                  nominal.record.actuator, nominal.record.wind):  # fmt: skip
        digest.update(np.ascontiguousarray(array).tobytes())
    return disk_cache.folder() / FOLDER / f"{digest.hexdigest()}.npy"


def _read(path: Path) -> np.ndarray | None:
    try:
        found = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile):
        return None
    return found if found.shape == (7,) and np.isfinite(found).all() else None


def _keep(path: Path, numbers: np.ndarray) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with files.whole(path) as partial, partial.open("wb") as stream:
            np.save(stream, numbers)
    except OSError:  # a cache that cannot be written is no fault
        return
