"""A magnetic heading made true: heading = compass + deviation + variation, both + east.

The variation is the sentence's own, else that of RMC, else of the World Magnetic Model (Chulliat et
al., The US/UK World Magnetic Model, NOAA) for the place and the date. The model is good to half a
degree away from the magnetic poles, and its coefficients hold for five years each, from 2010 on.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import lru_cache

import numpy as np
from pygeomag import GeoMag

from shiplog.nomenclature.units import SECOND_NS

FIRST_YEAR, LAST_YEAR = 2010.0, 2030.0  # of the coefficients
BEYOND = 5.0  # years before and after them: the field drifts by up to 0.2 deg/yr from the model
EVALUATED = 40  # places of a voyage; between them the variation is interpolated
DIFFERS_DEG = 3.0  # of the sentence's variation and the model's: ten times the model's error
DEVIATION_SIGMA_DEG = 3.0  # of a compass whose deviation is not known; a swung one has 0.5 to 1


@dataclass(frozen=True, slots=True)
class Track:
    """Where the ship was: time [n] ns, latitude and longitude [n] deg."""

    time: np.ndarray
    latitude: np.ndarray
    longitude: np.ndarray


@dataclass(frozen=True, slots=True)
class Variation:
    """What made a compass true."""

    degrees: float  # median
    source: str  # "sentence", "RMC" or the model's name
    model_deg: float | None  # of the World Magnetic Model, where place and date are known
    deviation: bool  # the sentence gives one

    @property
    def differs(self) -> bool:
        return self.model_deg is not None and abs(self.degrees - self.model_deg) > DIFFERS_DEG

    @property
    def metadata(self) -> dict[str, str]:
        noted = {"variation_deg": f"{self.degrees:.2f}", "variation_source": self.source}
        if not self.deviation:
            noted |= {"deviation": "unknown", "sigma_deg": f"{DEVIATION_SIGMA_DEG:g}"}
        return noted


def true_heading(
    time: np.ndarray, compass: np.ndarray, track: Track, other: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, Variation] | None:
    """True headings [n] deg, and how they were made; None where no variation is known.

    time     [n] ns
    compass  [n, 3] deg, what the compass shows, the sentence's variation and deviation, or NaN
    other    times [m] ns and variations [m] deg of RMC
    """
    shown, own, deviation = compass.T
    model, name = by_model(time, track)
    source = "sentence"
    variation = own.copy()
    if np.isfinite(own).any():
        known = np.flatnonzero(np.isfinite(own))
        at = np.searchsorted(known, np.arange(len(own)), side="right") - 1
        variation = own[known[at.clip(0)]]  # what a sentence leaves out is as the one before
    else:
        received, given = other
        if len(given):
            source = "RMC"
            at = np.searchsorted(received, time, side="right") - 1
            variation = given[at.clip(0)]
        far = model is not None and len(given) and abs(np.median(variation - model)) > DIFFERS_DEG
        if model is not None and (not len(given) or far):
            source, variation = name, model
        elif not len(given):
            return None
    heading = (shown + np.nan_to_num(deviation) + variation) % 360.0
    of_model = None if model is None else float(np.median(model))
    found = Variation(
        float(np.median(variation)), source, of_model, bool(np.isfinite(deviation).any())
    )
    return heading, found


def by_model(time: np.ndarray, track: Track) -> tuple[np.ndarray | None, str]:
    """Variation [n] deg, + east, at times [n] ns, and the model's name; None where the ship's
    place is not known, or the date is none of the model's."""
    if not len(track.time) or not len(time):
        return None, ""
    begin, end = int(time[0]), int(time.max())
    grid = np.unique(np.linspace(0, end - begin, EVALUATED).astype(np.int64)) + begin
    base = int(track.time[0])
    order = np.argsort(track.time, kind="stable")
    since = (track.time[order] - base).astype(float)
    latitude = np.interp((grid - base).astype(float), since, track.latitude[order])
    longitude = np.unwrap(track.longitude[order], period=360.0)
    longitude = np.interp((grid - base).astype(float), since, longitude)
    values, name = [], ""
    for at, north, east in zip(grid.tolist(), latitude.tolist(), longitude.tolist(), strict=True):
        year = _year(at)
        if not FIRST_YEAR - BEYOND <= year < LAST_YEAR + BEYOND:
            return None, ""
        model = _model(min(max(int(year), int(FIRST_YEAR)), int(LAST_YEAR) - 1))
        east = (east + 180.0) % 360.0 - 180.0
        found = model.calculate(north, east, 0.0, year, allow_date_outside_lifespan=True)
        values.append(found.d)
        name = model.model
        if not FIRST_YEAR <= year < LAST_YEAR:
            name += ", beyond its years"
    smooth = np.asarray(np.unwrap(np.array(values, float), period=360.0), float)
    return np.interp((time - begin).astype(float), (grid - begin).astype(float), smooth), name


@lru_cache
def _model(year: int) -> GeoMag:
    return GeoMag(base_year=datetime(year, 1, 1, tzinfo=UTC))


def _year(time_ns: int) -> float:
    """Decimal year."""
    when = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=time_ns / SECOND_NS)
    begin = datetime(when.year, 1, 1, tzinfo=UTC)
    length = datetime(when.year + 1, 1, 1, tzinfo=UTC) - begin
    return when.year + (when - begin) / length
