"""Lines of a draft on how exact an instrument is, estimated from what it recorded."""

from __future__ import annotations

import math

import numpy as np

from shiplog.drafting.motion import quaternion_heading
from shiplog.nomenclature import frames, units
from shiplog.voyages.rows import fault_detection, noise_estimate
from shiplog.voyages.rows.sample_faults import POLAR, RATES

METRE = 111_320.0  # m, a degree of latitude, near enough for an accuracy
HOW = "estimated from the record: how far neighbouring samples scatter"
STEPS = "estimated from the record: its values are whole multiples of that"
LEAST = 1e-7  # in its unit: less is the rounding of a computation
FELT = 0.5  # of sigma: a finer step is one of the numbers that were written, not of the instrument
NOT_SHOWN = (
    "# sigma = 0.0  # CHECK: the record does not show it; one standard deviation, of its data sheet"
)


def lines(
    name: str, kind: str, time: np.ndarray, values: np.ndarray, given: list[str]
) -> list[str]:
    """`sigma` and `resolution` of a sensor, in the first unit of `given`; a position's in m.

    time [n] ns; values [n, k] in SI, of a geodetic position in deg, NaN where there is none
    """
    known = np.isfinite(values).all(axis=1)
    rising = np.concatenate(([True], np.diff(time[known]) > 0))[: known.sum()]
    time, raw = time[known][rising], values[known][rising]
    if len(raw) < noise_estimate.FEWEST:
        return [NOT_SHOWN]
    value = _metric(kind, raw)
    aside = 0.0
    if kind in POLAR:
        step = fault_detection.resolution(raw[:, :1])
        speed = float(np.quantile(np.abs(raw[:, 0]), 0.5))
        aside = fault_detection.resolution(raw[:, 1:])
    else:
        step, speed = fault_detection.resolution(value), 0.0
    sigma = noise_estimate.sigma(time, value, step, name in RATES)
    scale = 1.0 if name == "position" else units.factor(given[0])
    if sigma < LEAST * scale:
        return [NOT_SHOWN]
    found = _number(sigma / scale)
    if name == "wind":
        angle = max(sigma / max(speed, sigma), aside / math.sqrt(12.0))
        found = f"[{found}, {_number(angle / units.factor(given[-1]))}]"
    written = [f"sigma = {found}  # {HOW}"]
    if step > FELT * sigma:
        written.append(f"resolution = {_number(step / scale, 4)}  # {STEPS}")
    return written


def _metric(kind: str, raw: np.ndarray) -> np.ndarray:
    """Values of one unit that can be subtracted: metres, components, an unwrapped angle."""
    if kind == "geodetic":
        east = METRE * math.cos(math.radians(float(np.median(raw[:, 0]))))
        return (raw - np.median(raw, axis=0)) * np.array([METRE, east])
    if kind in POLAR:
        return frames.earth_velocity(raw[:, 0], raw[:, 1])
    if kind.startswith("quaternion"):
        raw = quaternion_heading(raw, kind)[:, None]
    if kind == "angle" or kind.startswith("quaternion"):
        return np.unwrap(raw, axis=0)
    return raw


def _number(value: float, digits: int = noise_estimate.DIGITS) -> str:
    """As TOML has it, without an exponent where it can be."""
    short = f"{value:.{digits}g}"
    plain = f"{float(short):.12f}".rstrip("0")
    return short if float(plain) != float(short) else plain + "0" * plain.endswith(".")
