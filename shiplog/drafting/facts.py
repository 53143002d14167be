"""What the data hold, in the few words of a comment in a draft."""

from __future__ import annotations

import polars as pl

FIRST_VALUES = 3  # values in a comment
LONGEST = 40  # letters of a text in a comment
POLE, ROUND = 90.0, 360.0  # deg, the largest latitude and longitude
NO_POSITION = 91.0  # deg, latitude that AIS has for "not available"
E7 = 1e-7  # deg, what receivers count whole numbers of
MOST_E7 = POLE / E7
MOST_DDMM = 100.0 * POLE  # 9000.00 is 90 degrees and no minutes
NOT_AVAILABLE = {"heading": 511.0, "sog": 102.3}  # what AIS has for "not available" [deg, kn]
FEW = 20  # rows of which it is told whether a value ever changes
SELDOM = 0.01  # of the rows: a value in fewer of them is no measurement of the voyage
BURSTS = 5.0  # times the median step that the mean one is where several rows come at once
ASKED = 8  # vessels named where a draft has to ask


def of_values(values: pl.Series) -> str:
    """Range and first values of a column; `nothing` where it is blank."""
    if values.dtype == pl.String or not (values.dtype.is_numeric() or values.dtype == pl.Boolean):
        return "first " + ", ".join(_cut(v) for v in values.drop_nulls().head(FIRST_VALUES))
    number = values.cast(pl.Float64, strict=False).fill_nan(None).drop_nulls()
    if number.is_empty():
        return "holds nothing"
    first = ", ".join(f"{v:.7g}" for v in number.head(FIRST_VALUES))
    return f"{number.min():.7g} to {number.max():.7g}; first {first}"


def _cut(value: object) -> str:
    """A text, quoted; of one that is long its beginning."""
    text = str(value)
    return repr(text if len(text) <= LONGEST else text[:LONGEST] + "...")


def of_coordinates(latitude: pl.Series, longitude: pl.Series) -> list[str]:
    """A line of a draft on the factor of coordinates that are no degrees; none where they are."""
    factor, check = scale_of_coordinates(latitude, longitude)
    if factor != 1.0:
        return [f"sign = {factor:g}  # CHECK: {check}"]
    return [f"# CHECK: {check}"] if check else []


def scale_of_coordinates(latitude: pl.Series, longitude: pl.Series) -> tuple[float, str]:
    """(factor to degrees, what to check) of coordinates, by their size.

    Receivers count in 1e-7 deg, NMEA writes degrees and minutes as one number, and AIS has 91 and
    181 where it has no position.
    """
    north, east = (v.fill_nan(None).drop_nulls() for v in (latitude, longitude))
    most_north, most_east = (_largest(v) for v in (north, east))
    if most_north <= POLE and most_east <= ROUND:
        return 1.0, ""
    if most_north == NO_POSITION and most_east <= ROUND:
        return 1.0, '91 and 181 are AIS\'s "not available"; blank them'
    if most_north <= MOST_DDMM and most_east <= 2.0 * MOST_DDMM:
        return 1.0, "beyond 90; degrees and minutes in one number (ddmm.mm)? write degrees"
    whole = bool((north % 1 == 0).all()) and bool((east % 1 == 0).all())
    if whole and most_north <= MOST_E7 and most_east <= 4.0 * MOST_E7:
        return E7, "taken as 1e-7 deg, for the size of its whole numbers"
    return 1.0, "beyond 90, these are no degrees"


def unavailable(channel: str, values: pl.Series) -> str:
    """What to check of a heading or course that AIS marks as not there; nothing for others."""
    if channel not in NOT_AVAILABLE or not values.dtype.is_numeric():
        return ""
    mark, numbers = NOT_AVAILABLE[channel], values.cast(pl.Float64).fill_nan(None).drop_nulls()
    if numbers.is_empty() or numbers.max() != mark:
        return ""
    return f'{mark:g} is AIS\'s "not available": missing = [{mark:g}] blanks it'


def holds(channel: str, values: pl.Series) -> bool:
    """Whether a column has any value that is one; texts are left to their reader."""
    if not values.dtype.is_numeric():
        return values.null_count() < len(values)
    numbers = values.cast(pl.Float64)
    mark = NOT_AVAILABLE.get(channel)
    return bool((numbers.is_finite() & (numbers != mark if mark else True)).any())


def idle(values: pl.Series) -> int:
    """1 of a column that holds one value throughout, or one in hardly any row; else 0."""
    if not values.dtype.is_numeric():
        return 0
    numbers = values.cast(pl.Float64).fill_nan(None).drop_nulls()
    seldom = len(values) >= FEW and len(numbers) < SELDOM * len(values)
    return int(seldom or (len(numbers) >= FEW and numbers.n_unique() == 1))


def _largest(values: pl.Series) -> float:
    most = values.abs().max()
    return float(most) if isinstance(most, (int, float)) else 0.0


def of_times(times: pl.Series) -> str:
    """Rate and count of messages at `times` [ns]: the median's, of bursts the mean's."""
    steps = times.diff().drop_nulls()
    steps = steps.filter(steps >= 0)  # a table of several voyages begins again
    step, mean = steps.median(), steps.mean()
    if not isinstance(step, (int, float)) or not isinstance(mean, (int, float)) or mean <= 0:
        return f"{len(times)} messages"
    longest = steps.quantile(1.0 - 1.0 / BURSTS) or 0.0
    if step < mean / BURSTS and len(times) >= FEW and longest >= mean:
        return f"{1e9 / mean:.3g} Hz in bursts, {len(times)} messages"
    return f"{1e9 / step:.3g} Hz, {len(times)} messages" if step > 0 else f"{len(times)} messages"


def counted(counts: dict[str, int], what: str) -> str:
    """The largest of many, for a question."""
    most = sorted(counts, key=lambda name: -counts[name])[:ASKED]
    text = ", ".join(f"{name} ({counts[name]} {what})" for name in most)
    return text + (f", and {len(counts) - len(most)} more" if len(counts) > len(most) else "")
