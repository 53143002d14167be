"""What makes a picture of tracks a chart: coordinates, a scale bar, and arrows of north, wind and
current above it; below it what each colour is.

Rerun's 2D views have y pointing down, so a place is drawn at (y₀, -x₀). No map is drawn below the
tracks: each of the map providers of Rerun's own map view asks a server elsewhere for its pictures.
Where a log had latitude and longitude, the edges of the chart have them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import rerun as rr

from shiplog.nomenclature import frames
from shiplog.report import colours
from shiplog.report.viewer import style
from shiplog.report.viewer.comparison_data import Current
from shiplog.report.viewer.style import entity
from shiplog.report.viewer.surroundings import Wind

NARROWEST = 0.7  # width over height: words side by side need some
LEFT, BELOW, ABOVE = 0.11, 0.07, 0.17  # of the chart's size: for coordinates, and for arrows
ROW = 0.075  # of the size: a line of the key
LETTERS = 64  # of the key side by side, where a chart has a third of a screen of 1920 points
ARROW = 0.075  # of the size: an arrow's length
MINUTE_M = 1852.0  # m: a minute of latitude
DEGREE = 60  # minutes

Ends = tuple[float, float]


@dataclass(frozen=True)
class Frame:
    """Where things are on a chart, in its own units (m or km): east and north.

    tracks  the part with the tracks
    whole   with room for coordinates and words
    """

    east: Ends
    north: Ends
    whole_east: Ends
    whole_north: Ends
    size: float
    columns: int  # of the key

    @property
    def x_range(self) -> list[float]:
        return list(self.whole_east)

    @property
    def y_range(self) -> list[float]:
        return [-self.whole_north[1], -self.whole_north[0]]


def frame(east: Ends, north: Ends, entries: list[str]) -> Frame:
    """Around tracks of this extent, with a key of these entries."""
    tall = north[1] - north[0]
    wide = max(east[1] - east[0], NARROWEST * tall)
    middle = (east[0] + east[1]) / 2.0
    east = (middle - wide / 2.0, middle + wide / 2.0)
    size = max(wide, tall)
    columns = max(1, min(4, LETTERS // (max(map(len, entries), default=1) + 4)))
    rows = math.ceil(len(entries) / columns)
    return Frame(
        east,
        north,
        (east[0] - LEFT * size, east[1] + 0.02 * size),
        (north[0] - (BELOW + ROW * rows) * size, north[1] + ABOVE * size),
        size,
        columns,
    )


def grid_step(extent: float) -> float:
    """Metres between grid lines: 1, 2 or 5 times a power of ten, some five lines a side."""
    power = 10.0 ** math.floor(math.log10(extent / 5.0))
    return next(power * k for k in (1.0, 2.0, 5.0, 10.0) if extent / (power * k) <= 7.5)


def send_grid(
    recording: rr.RecordingStream, voyage: str, frame: Frame, metres: float,
    datum: tuple[float, float] | None,
) -> None:  # fmt: skip
    """Lines at round numbers with their names, and at their other end latitude and longitude.

    metres   in a unit of the chart
    """
    east, north = frame.east, frame.north
    step = grid_step(frame.size)
    beyond = 3 * step  # lines go on where the view is wider than the track
    meridians, parallels = _round(east, step, beyond), _round(north, step, beyond)
    grid = [[(x, -north[1] - beyond), (x, beyond - north[0])] for x in meridians]
    grid += [[(east[0] - beyond, -y), (east[1] + beyond, -y)] for y in parallels]
    recording.log(
        entity("track", voyage, "grid"),
        rr.LineStrips2D(grid, colors=colours.GRID, radii=rr.Radius.ui_points(0.5), draw_order=1.0),
        static=True,
    )
    meridians, parallels = _round(east, step), _round(north, step)  # none in a narrow chart
    left, bottom = east[0] - 0.055 * frame.size, 0.01 * frame.size - north[0]
    places = [(x, bottom) for x in meridians] + [(left, -y) for y in parallels]
    names = [f"y₀ {x:g}" for x in meridians] + [f"x₀ {y:g}" for y in parallels]
    style.labels(recording, entity("track", voyage, "grid", "labels"), places, names)
    if datum is not None:
        names = _coordinates(meridians, parallels, frame, metres, datum)
        top, right = -north[1], east[1] - 0.06 * frame.size
        places = [(x, top) for x in meridians[::2]] + [(right, -y) for y in parallels]
        style.labels(recording, entity("track", voyage, "grid", "coordinates"), places, names)


def _coordinates(
    meridians: np.ndarray, parallels: np.ndarray, frame: Frame, metres: float,
    datum: tuple[float, float],
) -> list[str]:  # fmt: skip
    """Longitude of every other meridian along the top edge, latitude of each parallel."""
    step = grid_step(frame.size) * metres
    digits = min(max(math.ceil(-math.log10(step / MINUTE_M)) + 1, 1), 4)
    top, right = frame.north[1] * metres, frame.east[1] * metres
    longitudes = (frames.geodetic(top, x * metres, datum)[1] for x in meridians[::2])
    latitudes = (frames.geodetic(y * metres, right, datum)[0] for y in parallels)
    return [
        *(in_minutes(degrees, "EW", digits) for degrees in longitudes),
        *(in_minutes(degrees, "NS", digits) for degrees in latitudes),
    ]


def in_minutes(degrees: float, letters: str, digits: int) -> str:
    """As on a chart: 34.5125, "NS" → 34°30.75'N."""
    minutes = round(abs(degrees) * DEGREE, digits)
    whole, rest = divmod(minutes, DEGREE)
    width = digits + 3 if digits else 2
    return f"{whole:.0f}°{rest:0{width}.{digits}f}'{letters[degrees < 0.0]}"


def send_arrows(
    recording: rr.RecordingStream, voyage: str, frame: Frame, unit: str,
    wind: Wind | None, current: Current | None,
) -> None:  # fmt: skip
    """In a row above the tracks: north, the wind, the current, a scale bar."""
    arrows = [("N", 0.0, colours.TEXT)]
    if wind is not None and wind.steady:
        # drawn as it blows, said as it is called: by where it comes from
        name = f"wind {wind.speed:.2g} m/s from {_bearing(wind.comes_from)}"
        arrows.append((name, wind.comes_from + math.pi, colours.WIND))
    if current is not None:
        name = f"current {current.speed:.2g} m/s to {_bearing(current.direction)}"
        arrows.append((name, current.direction, colours.CURRENT))
    length = ARROW * frame.size
    shares = [0.08, 0.36, 0.7][: len(arrows)] if len(arrows) > 2 else [0.08, 0.42][: len(arrows)]
    width = frame.whole_east[1] - frame.whole_east[0]
    middle = -frame.whole_north[1] + 0.055 * frame.size
    centres = [(frame.whole_east[0] + share * width, middle) for share in shares]
    vectors = [(length * math.sin(a), -length * math.cos(a)) for _, a, _ in arrows]
    recording.log(
        entity("track", voyage, "arrows"),
        rr.Arrows2D(
            origins=[(x - dx / 2.0, y - dy / 2.0) for (x, y), (dx, dy) in zip(
                centres, vectors, strict=True)],
            vectors=vectors,
            colors=[colour for *_, colour in arrows],
            radii=rr.Radius.ui_points(2.0),
            draw_order=40.0,
        ),
        static=True,
    )  # fmt: skip
    words = [(x, y + 0.045 * frame.size) for x, y in centres]
    names = [name for name, *_ in arrows]
    bar = _scale(frame)
    end = frame.whole_east[1] - 0.03 * frame.size
    recording.log(
        entity("track", voyage, "scale"),
        rr.LineStrips2D(
            [[(end - bar, middle), (end, middle)],
             *([(x, middle - 0.01 * frame.size), (x, middle + 0.01 * frame.size)]
               for x in (end - bar, end))],
            colors=colours.TEXT,
            radii=rr.Radius.ui_points(1.5),
            draw_order=40.0,
        ),
        static=True,
    )  # fmt: skip
    words.append((end - bar / 2.0, middle + 0.045 * frame.size))
    names.append(f"{bar:g} {unit}")
    style.labels(recording, entity("track", voyage, "arrows", "labels"), words, names)


def _scale(frame: Frame) -> float:
    """A round length of a tenth to a fifth of the chart: 1, 2 or 5 times a power of ten."""
    most = 0.2 * frame.size
    power = 10.0 ** math.floor(math.log10(most))
    return max(power * k for k in (1.0, 2.0, 5.0) if power * k <= most)


def _bearing(angle: float) -> str:
    """Three figures, clockwise from north, as bearings are written: 005°."""
    return f"{round(math.degrees(angle)) % 360:03d}°"


def send_key(
    recording: rr.RecordingStream, voyage: str, frame: Frame, entries: dict[str, colours.Colour]
) -> None:
    """Below the tracks, side by side: a line of each colour, and below it what it is."""
    width = (frame.whole_east[1] - frame.whole_east[0]) / frame.columns
    top = (BELOW + 0.015) * frame.size - frame.north[0]
    places = [
        (
            frame.whole_east[0] + (number % frame.columns + 0.5) * width,
            top + ROW * frame.size * (number // frame.columns),
        )
        for number in range(len(entries))
    ]
    half = 0.06 * frame.size
    recording.log(
        entity("track", voyage, "key"),
        rr.LineStrips2D(
            [[(x - half, y), (x + half, y)] for x, y in places],
            colors=list(entries.values()),
            radii=rr.Radius.ui_points(2.0),
            draw_order=40.0,
        ),
        static=True,
    )
    words = [(x, y + 0.012 * frame.size) for x, y in places]
    style.labels(recording, entity("track", voyage, "key", "labels"), words, list(entries))


def _round(span: Ends, step: float, beyond: float = 0.0) -> np.ndarray:
    """The multiples of `step` in a span [m], and so far beyond it."""
    first, last = math.ceil((span[0] - beyond) / step), math.floor((span[1] + beyond) / step)
    return np.arange(first, last + 1) * step
