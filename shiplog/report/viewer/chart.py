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
from shiplog.nomenclature.numbers import in_minutes
from shiplog.report import colours
from shiplog.report.figures.wind import Wind
from shiplog.report.viewer import style, surroundings
from shiplog.report.viewer.comparison_data import Current
from shiplog.report.viewer.style import entity

# Words keep their size on the screen whatever the chart shows, so room for them is planned in
# points, of a screen of 1920 by 1080 with the window as large; on another one all shrinks alike.
TALL, FLAT = (780.0, 950.0), (780.0, 560.0)  # points: the view of a chart alone, and above a text
LEFT, RIGHT, ABOVE, BELOW = 85.0, 20.0, 125.0, 45.0  # points: x₀ and y₀, and arrows above
LATITUDE = 110.0  # points: instead of RIGHT
ROW = 50.0  # points: a line of the key
LETTER = 7.2  # points: a letter is wide
ARROW = 55.0  # points: an arrow is long
LINE = 26.0  # points: from a place to the word below it
MINUTE_M = 1852.0  # m: a minute of latitude

Ends = tuple[float, float]


@dataclass(frozen=True)
class Frame:
    """Where things are on a chart, in its own units (m or km): east and north.

    east, north              the part with the tracks
    whole_east, whole_north  with room for coordinates and words: as wide and tall as the view
    point                    a point of the screen, in units of the chart
    columns                  of the key
    """

    east: Ends
    north: Ends
    whole_east: Ends
    whole_north: Ends
    point: float
    columns: int

    @property
    def x_range(self) -> list[float]:
        return list(self.whole_east)

    @property
    def y_range(self) -> list[float]:
        return [-self.whole_north[1], -self.whole_north[0]]

    @property
    def size(self) -> float:
        return max(self.east[1] - self.east[0], self.north[1] - self.north[0])


def frame(
    east: Ends, north: Ends, entries: list[str], view: tuple[float, float] = TALL,
    coordinates: bool = False,
) -> Frame:  # fmt: skip
    """Around tracks of this extent, with a key of these entries, in a view [points].

    coordinates   with latitudes on its right
    """
    wide, tall = view
    right_room = LATITUDE if coordinates else RIGHT
    longest = max(map(len, entries), default=1) * LETTER + 25.0
    columns = int(max(1, min(4, len(entries), wide // longest)))
    below = BELOW + ROW * math.ceil(len(entries) / columns)
    inner = (wide - LEFT - right_room, tall - ABOVE - below)
    point = max((e[1] - e[0]) / length for e, length in zip((east, north), inner, strict=True))
    east, north = (
        _about((e[0] + e[1]) / 2.0, length * point)
        for e, length in zip((east, north), inner, strict=True)
    )
    return Frame(
        east,
        north,
        (east[0] - LEFT * point, east[1] + right_room * point),
        (north[0] - below * point, north[1] + ABOVE * point),
        point,
        columns,
    )


def _about(middle: float, length: float) -> Ends:
    return middle - length / 2.0, middle + length / 2.0


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
    beyond = 6 * step  # lines go on where the view is wider than the track
    meridians, parallels = _round(east, step, beyond), _round(north, step, beyond)
    grid = [[(x, -north[1] - beyond), (x, beyond - north[0])] for x in meridians]
    grid += [[(east[0] - beyond, -y), (east[1] + beyond, -y)] for y in parallels]
    recording.log(
        entity("track", voyage, "grid"),
        rr.LineStrips2D(grid, colors=colours.GRID, radii=rr.Radius.ui_points(0.5), draw_order=1.0),
        static=True,
    )
    meridians, parallels = _round(east, step), _round(north, step)  # none in a narrow chart
    left, bottom = east[0] - 45.0 * frame.point, 5.0 * frame.point - north[0]
    places = [(x, bottom) for x in meridians] + [(left, -y) for y in parallels]
    names = [f"y₀ {x:g}" for x in meridians] + [f"x₀ {y:g}" for y in parallels]
    style.labels(recording, entity("track", voyage, "grid", "labels"), places, names)
    if datum is not None:
        names = _coordinates(meridians, parallels, frame, metres, datum)
        top, right = -north[1] - 0.7 * LINE * frame.point, east[1] + 0.5 * LATITUDE * frame.point
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


def send_arrows(
    recording: rr.RecordingStream, voyage: str, frame: Frame, unit: str,
    wind: Wind | None, current: Current | None,
) -> None:  # fmt: skip
    """In a row above the tracks: north, the wind, the current, a scale bar."""
    arrows = [("N", 0.0, colours.TEXT)]
    if wind is not None and wind.steady:
        # drawn as it blows, said as it is called: by where it comes from
        arrows.append((wind.said, wind.comes_from + math.pi, colours.WIND))
    if current is not None:
        arrows.append((surroundings.said(current), current.direction, colours.CURRENT))
    length = ARROW * frame.point
    shares = (0.08, 0.33, 0.62)  # of the width
    width = frame.whole_east[1] - frame.whole_east[0]
    middle = -frame.whole_north[1] + (ARROW / 2.0 + 10.0) * frame.point
    centres = [(frame.whole_east[0] + share * width, middle) for share in shares[: len(arrows)]]
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
    below = (ARROW / 2.0) * frame.point
    words = [(x, y + below) for x, y in centres]
    names = [name for name, *_ in arrows]
    bar = _scale(frame)
    end, tick = frame.whole_east[1] - 30.0 * frame.point, 6.0 * frame.point
    recording.log(
        entity("track", voyage, "scale"),
        rr.LineStrips2D(
            [[(end - bar, middle), (end, middle)],
             *([(x, middle - tick), (x, middle + tick)]
               for x in (end - bar, end))],
            colors=colours.TEXT,
            radii=rr.Radius.ui_points(1.5),
            draw_order=40.0,
        ),
        static=True,
    )  # fmt: skip
    words.append((end - bar / 2.0, middle + below))
    names.append(f"{bar:g} {unit}")
    style.labels(recording, entity("track", voyage, "arrows", "labels"), words, names)


def _scale(frame: Frame) -> float:
    """A round length of at most 130 points: 1, 2 or 5 times a power of ten."""
    most = 130.0 * frame.point
    power = 10.0 ** math.floor(math.log10(most))
    return max(power * k for k in (1.0, 2.0, 5.0) if power * k <= most)


def send_key(
    recording: rr.RecordingStream, voyage: str, frame: Frame, entries: dict[str, colours.Colour]
) -> None:
    """Below the tracks, side by side: a line of each colour, and below it what it is."""
    width = (frame.whole_east[1] - frame.whole_east[0]) / frame.columns
    top = BELOW * frame.point - frame.north[0]
    places = [
        (
            frame.whole_east[0] + (number % frame.columns + 0.5) * width,
            top + ROW * frame.point * (number // frame.columns),
        )
        for number in range(len(entries))
    ]
    half = 40.0 * frame.point
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
    words = [(x, y + 4.0 * frame.point) for x, y in places]
    style.labels(recording, entity("track", voyage, "key", "labels"), words, list(entries))


def _round(span: Ends, step: float, beyond: float = 0.0) -> np.ndarray:
    """The multiples of `step` in a span [m], and so far beyond it."""
    first, last = math.ceil((span[0] - beyond) / step), math.floor((span[1] + beyond) / step)
    return np.arange(first, last + 1) * step
