"""Unknown structures: accelerations that depend on something, whatever the cause may be.

Smooth functions of position, heading, time, motion, controls or wind, as weighted random Fourier
features (Rahimi & Recht 2007). They stand beside the causes on one scale of evidence: what no
cause of the catalogue explains, but a map of the pond does, is unknown and depends on position.

A few plain products of what the ship's own actuators do stand beside the many features of controls:
what has little freedom pays little for it, and shows a force of a screw that no cause has before it
is taken for another one's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shiplog.linearise import resampled
from shiplog.record import Record
from shiplog.segments import Cut, Grid

FAMILIES = ("position", "heading", "time", "motion", "controls", "wind")
UNSEEN = ("position", "heading", "time")  # by any model of forces, a network too
FEATURES = 20
SIZES = (1.0, 3.0, 9.0)  # of the accelerations, in units of the ordinary unrest


@dataclass(frozen=True)
class Knots:
    """What went on at the knots of S segments.

    state   [S, J, 6]
    driven  [S, J, A + 3]  actuators, share of the campaign, true wind
    """

    state: np.ndarray
    driven: np.ndarray


def at_knots(segments: Cut, g: Grid) -> Knots:
    centre = (np.arange(g.bins) + 0.5) * g.seconds / g.bins
    every = round(g.knot / (g.step * g.every))
    state = resampled(centre, segments.y, np.arange(g.knots) * g.knot)
    return Knots(state, segments.driven[:, ::every])


@dataclass(frozen=True)
class Basis:
    """One family's features, the same for both campaigns.

    middle, width  [n]     of the variables
    frequency      [n, F]  and phase [F]
    """

    family: str
    middle: np.ndarray
    width: np.ndarray
    frequency: np.ndarray
    phase: np.ndarray
    level: np.ndarray | None = None  # [F] taken off: what is always there does not depend

    def features(self, knots: Knots) -> np.ndarray:
        """[S, J, 3, W]: acceleration of each weight, of unit size."""
        z = (_variables(self.family, knots) - self.middle) / self.width
        waves = self._waves(z)
        if self.level is not None:
            waves = waves - self.level
        out = in_each_channel(waves)
        if self.family != "position":
            return out
        # what pulls towards a place pulls along the earth's axes
        c, s = np.cos(knots.state[..., 4]), np.sin(knots.state[..., 4])
        north, east = out[..., 0, :].copy(), out[..., 1, :].copy()
        out[..., 0, :] = c[..., None] * north + s[..., None] * east
        out[..., 1, :] = c[..., None] * east - s[..., None] * north
        return out

    def _waves(self, z: np.ndarray) -> np.ndarray:
        return np.sqrt(2.0 / len(self.phase)) * np.cos(z @ self.frequency + self.phase)


@dataclass(frozen=True)
class Products:
    """a|a| of everything that drives or turns, and of each that turns with each that drives:
    n|n| sin δ, and n|n| cos δ of what turns all the way round.

    scale [V]   root mean square of each
    turning     columns of angles, and of those that go all the way `round`; `driving` of speeds
    """

    scale: np.ndarray
    turning: tuple[int, ...]
    round: tuple[int, ...]
    driving: tuple[int, ...]

    def features(self, knots: Knots) -> np.ndarray:
        """[S, J, 3, W], as of a Basis."""
        a = self.of(knots) / self.scale
        squares, drive = a * np.abs(a), len(self.driving)
        jets = [
            a[..., [i]] * squares[..., [j]] for i in range(drive, a.shape[-1]) for j in range(drive)
        ]
        found = np.concatenate((squares, *jets), -1)
        return in_each_channel(found / np.sqrt(found.shape[-1]))

    def of(self, knots: Knots) -> np.ndarray:
        """[S, J, V]: speeds, sines, cosines."""
        a = knots.driven
        return np.concatenate(
            (
                a[..., list(self.driving)],
                np.sin(a[..., list(self.turning)]),
                np.cos(a[..., list(self.round)]),
            ),
            -1,
        )


def products(record: Record, *campaigns: Knots) -> Products:
    """Of the ship's actuators, in units of what they did in the campaigns."""
    kinds = [one.kind for one in record.profile.actuators]
    azimuths = tuple(i for i, kind in enumerate(kinds) if kind == "azimuth")
    turning = tuple(i for i, kind in enumerate(kinds) if kind == "rudder") + azimuths
    driving = tuple(i for i in range(len(kinds)) if i not in turning)
    plain = Products(np.ones(1), turning, azimuths, driving)
    rows = np.concatenate([np.concatenate(plain.of(knots)) for knots in campaigns])
    scale = np.sqrt((rows**2).mean(0))
    return replace(plain, scale=np.where(scale > 1e-9, scale, 1.0))


def in_each_channel(waves: np.ndarray) -> np.ndarray:
    """[S, J, F] → [S, J, 3, 3F]."""
    count = waves.shape[-1]
    out = np.zeros((*waves.shape[:2], 3, 3 * count))
    for channel in range(3):
        out[..., channel, channel * count : (channel + 1) * count] = waves
    return out


def basis(family: str, record: Record, *campaigns: Knots) -> Basis | None:
    """None where the campaigns hold nothing of the family, such as no wind."""
    if family == "wind" and not record.profile.has_wind:
        return None
    z = np.concatenate([_variables(family, k).reshape(-1, _count(family, k)) for k in campaigns])
    middle, width = z.mean(0), z.std(0)
    if not (width > 1e-9).any():
        return None
    width = np.where(width > 1e-9, width, 1.0)
    rng = np.random.default_rng([len(family), *family.encode()])
    count = z.shape[1]
    if family == "heading":  # harmonics of one angle: cosine and sine come from the phase
        order = np.arange(FEATURES) // 2 % 3 + 1
        return Basis(
            family, np.zeros(1), np.ones(1), order[None].astype(float),
            np.where(np.arange(FEATURES) % 2, -0.5 * np.pi, 0.0),
        )  # fmt: skip
    frequency = rng.standard_normal((count, FEATURES)) / np.sqrt(max(count / 2.0, 1.0))
    found = Basis(family, middle, width, frequency, rng.uniform(0.0, 2.0 * np.pi, FEATURES))
    if family != "time":  # a push that is always there is no drift; it may well be the screw's
        return found
    return replace(found, level=found._waves((z - middle) / width).mean(0))


def _variables(family: str, knots: Knots) -> np.ndarray:
    state, driven = knots.state, knots.driven
    if family == "position":
        return state[..., [0, 2]]
    if family == "heading":
        return state[..., [4]]
    if family == "time":
        return driven[..., [-3]]
    if family == "motion":
        return state[..., [1, 3, 5]]
    if family == "controls":
        return driven[..., :-3]
    c, s = np.cos(state[..., 4]), np.sin(state[..., 4])
    north, east = driven[..., -2], driven[..., -1]
    return np.stack(
        (c * north + s * east + state[..., 1], c * east - s * north + state[..., 3]), -1
    )


def _count(family: str, knots: Knots) -> int:
    return int(_variables(family, knots).shape[-1])


def pushed(features: np.ndarray, push: np.ndarray) -> np.ndarray:
    """[S, 3J, W]: acceleration of each weight at the knots, channel by channel; `push` [3] is the
    unit of size."""
    scaled = np.moveaxis(features * push[:, None], 2, 1)
    return scaled.reshape(len(scaled), -1, scaled.shape[-1])
