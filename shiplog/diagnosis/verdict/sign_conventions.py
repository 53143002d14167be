"""Conventions and units in which a log and a profile may differ, tried one at a time.

No coefficient corrects a rudder of the wrong sign, and a speed in knots looks like an offset of the
rudders. So the windows are read once more under each convention that logs are known to have, and
the model's error L is compared: with no number fitted, a convention is one explanation, and a set
of causes that does no better is a worse one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.models.causes.actuator_pairs import ActuatorsExchanged
from shiplog.nomenclature.frames import axes
from shiplog.ship_profile.profile import Profile
from shiplog.ship_profile.profile_lines import declared
from shiplog.simulation.error_reduction import RUNAWAY, parts
from shiplog.simulation.extended_simulator import ExtendedSimulator, as_record
from shiplog.voyages.rows.instruments import Sighted
from shiplog.voyages.windows.windows import Windows

DEGREES = 180.0 / math.pi
KNOTS, KMH, RPM, PER_MINUTE = 3600.0 / 1852.0, 3.6, 60.0, 60.0
# Of a channel: factor of what was recorded over what was → the slip
SPEEDS = {
    KNOTS: "knots that are called m/s", 1.0 / KNOTS: "m/s that are called knots",
    KMH: "km/h that are called m/s", 1.0 / KMH: "m/s that are called km/h",
    KMH / KNOTS: "km/h that are called knots", KNOTS / KMH: "knots that are called km/h",
}  # fmt: skip
RATES = {
    DEGREES: "deg/s that are called rad/s", 1.0 / DEGREES: "rad/s that are called deg/s",
    PER_MINUTE: "deg/min that are called deg/s", 1.0 / PER_MINUTE: "deg/s that are called deg/min",
}  # fmt: skip
ANGLES = {
    DEGREES: "degrees that are called radians", 1.0 / DEGREES: "radians that are called degrees",
}  # fmt: skip
TURNS = {
    RPM: "revolutions per minute that are called per second",
    1.0 / RPM: "revolutions per second that are called per minute",
}  # fmt: skip
# Ratio of L: where a known convention leaves no more than this many times what the velocity of the
# positions leaves, it is the explanation, and not that the velocity is wrong in some way.
NEARLY = 2.0
# The same of a slip that is none of this profile, such as km/h called knots where it states m/s: a
# recorder may have converted twice, but two units that differ by a twentieth err alike.
UNSTATED = 1.5
SPOKEN = {"kn": "knots", "rad": "radians", "deg": "degrees", "rpm": "per minute",
          "rps": "per second", "rev/s": "per second"}  # fmt: skip
# Share of the nominal error, below which the nominal voyages have a convention, too.
THERE_TOO = 0.8
INSTEAD = "the velocity replaced by that of the positions"


@dataclass(frozen=True)
class Turned:
    """A convention, in words; the windows under it; and the key of the profile to change.

    stated   whether the profile states the unit that the slip is called; True of what is no unit
    cause    name of the cause of the catalogue that is the same; empty of most
    idle     the windows with what the unit is of at zero; None of what is no actuator's unit
    """

    words: str
    windows: Windows
    key: str
    stated: bool = True
    cause: str = ""
    idle: Windows | None = None


@dataclass(frozen=True)
class Tried:
    """The convention under which a model errs least: its words, key and L.

    loss   mean L; where the convention makes velocities smaller, by so much greater as it would
           be made less by that alone
    there  L of the nominal windows under it over L of them as they are; None without any
    cause  as `Turned` has it
    """

    words: str
    key: str
    loss: float
    there: float | None = None
    cause: str = ""


def try_conventions(
    simulator: ExtendedSimulator, cut: Windows, nominal: Windows | None = None,
    read_as: Profile | None = None,
) -> Tried:  # fmt: skip
    """argmin over conventions of h L max(L_hold/L_hold', 1), with the mean L on these windows
    (RUNAWAY of one in which the model diverges), L_hold of constant velocities as the windows are
    and L_hold' under the convention, and a handicap h (NEARLY, UNSTATED, else 1).
    Where nominal windows are given, conventions that these show as well (L'/L ≤ THERE_TOO) are left
    out: their model has them, too. So is a unit of actuators that explains no more than that they
    do nothing, unless L' < TURNED_SIGN L_idle: a rudder that turns too little is none in degrees.

    read_as   the profile through which the windows were read; None where it is not known
    """
    still = _hold(cut)
    found, handicap = [], {INSTEAD: NEARLY}
    idle: dict[str, float] = {}  # key → L_idle, which the units of a kind share
    for one in conventions(simulator.profile, cut, read_as):
        loss = mean(simulator, one.windows) * max(still / max(_hold(one.windows), 1e-12), 1.0)
        if one.idle is not None:
            if one.key not in idle:
                idle[one.key] = mean(simulator, one.idle)
            if loss >= thresholds.TURNED_SIGN * idle[one.key]:
                continue
        found.append(Tried(one.words, one.key, loss, cause=one.cause))
        if not one.stated:
            handicap[one.words] = UNSTATED
    found.sort(key=lambda one: one.loss * handicap.get(one.words, 1.0))
    if nominal is None:
        return found[0]
    before, there = mean(simulator, nominal), {}
    for one in found:
        if not there:
            there = {t.words: t.windows for t in conventions(simulator.profile, nominal)}
        share = math.inf  # of a convention that the nominal windows cannot be read under
        if one.words in there:
            share = mean(simulator, there[one.words]) / max(before, 1e-12)
        if share > THERE_TOO:
            return replace(one, there=share)
    return replace(found[0], loss=RUNAWAY)


def mean(simulator: ExtendedSimulator, cut: Windows) -> float:
    """mean_w min(L_w, RUNAWAY)."""
    return float(_losses(simulator, cut).mean())


def _losses(simulator: ExtendedSimulator, cut: Windows) -> np.ndarray:
    """min(L_w, RUNAWAY) [N]."""
    each = np.nan_to_num(simulator.losses(cut), nan=RUNAWAY, posinf=RUNAWAY)
    return np.minimum(each, RUNAWAY)


def simulated(simulator: ExtendedSimulator, cut: Windows) -> Windows:
    """The windows in which the model does not diverge, or all, where it does in half of them and
    more. Two that diverge would outweigh all others, and whatever moves the ship less, such as
    rudders in another unit, would seem to explain them."""
    kept = _losses(simulator, cut) < RUNAWAY
    if kept.all() or 2 * kept.sum() <= len(kept):
        return cut
    return cut.pick(np.flatnonzero(kept))


def _hold(cut: Windows) -> float:
    """Mean L of keeping the first velocities."""
    return float(parts(cut.state[:, :1] - cut.state, cut.dt).sum(1).mean()) if len(cut) else 0.0


def conventions(profile: Profile, cut: Windows, read_as: Profile | None = None) -> Iterator[Turned]:
    """Signs of actuators of a kind, twins exchanged, their units; the wind's direction and unit;
    heading, yaw rate and velocity. read_as   as `try_conventions` has it"""
    yield from _actuator_signs(profile, cut, read_as)
    if cut.wind.shape[-1]:
        yield from _wind_signs(cut, read_as)
    if getattr(profile, "sensors", None) is not None:
        yield from _motion_signs(profile, cut, read_as)


def _stated(words: str, read_as: Profile | None, name: str, kind: str = "") -> bool:
    """Whether the profile calls a sensor's first field, or the actuators of a kind, by the unit
    that a slip is called."""
    if read_as is None:
        return True
    if kind:
        units = {one.unit or one.si_unit for one in read_as.actuators if one.kind == kind}
    else:
        units = {declared(read_as, name)}
    return any(words.endswith(f"called {SPOKEN.get(unit, unit)}") for unit in units)


def _actuator_signs(profile: Profile, cut: Windows, read_as: Profile | None) -> Iterator[Turned]:
    actuators = profile.actuators
    for kind in dict.fromkeys(a.kind for a in actuators):
        columns = [i for i, a in enumerate(actuators) if a.kind == kind]

        def scaled(factor: float, columns: list[int] = columns) -> Windows:
            turned = cut.actuator.copy()
            turned[..., columns] *= factor
            return replace(cut, actuator=turned)

        key = f"`sign` of each [[actuators]] of the kind {kind!r}"
        yield Turned(f"the {kind}'s sign turned round", scaled(-1.0), key)
        if len(columns) == 2:
            swapped = cut.actuator.copy()
            swapped[..., columns] = cut.actuator[..., columns[::-1]]
            yield Turned(
                f"the two {kind}s exchanged", replace(cut, actuator=swapped),
                f"`topic` of each [[actuators]] of the kind {kind!r}",
                cause=ActuatorsExchanged.name,
            )  # fmt: skip
        units = {"rudder": ANGLES, "propeller": TURNS}.get(kind, {})
        still = scaled(0.0) if units else None
        for factor, words in units.items():
            yield Turned(
                f"the {kind}'s values taken as {words}", scaled(1.0 / factor),
                f"`unit` of each [[actuators]] of the kind {kind!r}",
                _stated(words, read_as, "", kind), idle=still,
            )  # fmt: skip


def _wind_signs(cut: Windows, read_as: Profile | None) -> Iterator[Turned]:
    """γ + π, -γ, γ ± π/2, γ - ψ of the wind's angle γ; its speed over each factor of SPEEDS."""
    key = "[sensors.wind]"
    yield Turned(
        "the wind direction as the one that it blows towards",
        replace(cut, wind=cut.wind + np.array([0.0, math.pi])), f"`offset` of {key}",
    )  # fmt: skip
    yield Turned(
        "the wind's angle mirrored, port for starboard",
        replace(cut, wind=cut.wind * np.array([1.0, -1.0])), f"`sign` of {key}",
    )  # fmt: skip
    for side, quarter in (("starboard", 0.5 * math.pi), ("port", -0.5 * math.pi)):
        yield Turned(
            f"the wind's angle counted from {side}",
            replace(cut, wind=cut.wind + np.array([0.0, quarter])), f"`offset` of {key}",
        )  # fmt: skip
    from_north = cut.wind.copy()
    from_north[..., 1] -= cut.state[..., 4]
    yield Turned(
        "the wind's angle counted from north", replace(cut, wind=from_north), f"`fields` of {key}"
    )
    for factor, words in SPEEDS.items():
        yield Turned(
            f"the wind speed taken as {words}",
            replace(cut, wind=cut.wind / np.array([factor, 1.0])), f"`units` of {key}",
            _stated(words, read_as, "wind"),
        )  # fmt: skip


def _motion_signs(profile: Profile, cut: Windows, read_as: Profile | None) -> Iterator[Turned]:
    """-ψ, π/2 - ψ, ψ + π/2, ψ + π of the heading ψ, and ψ over each factor of ANGLES; -r and r over
    each of RATES; then `_velocity_signs`."""
    record = as_record(cut, profile, {}, {})
    seen = record.sighted

    def read(
        words: str, key: str, change: Callable[[Sighted], Sighted], stated: bool = True
    ) -> Turned:
        state = record.measured_as(change(seen)).state.reshape(cut.state.shape).copy()
        state[..., 4] = np.unwrap(state[..., 4], axis=1)
        return Turned(words, replace(cut, state=state), key, stated)

    def headed(heading: np.ndarray) -> Sighted:
        return replace(seen, heading=heading, axes=axes(heading))

    over_ground = profile.sensors.kind("velocity") != "body"
    key = "[sensors.heading]"
    psi = seen.heading
    yield read("the heading counted anticlockwise", f"`sign` of {key}", lambda _: headed(-psi))
    yield read(
        "the heading counted anticlockwise from east", f"`sign` and `offset` of {key}",
        lambda _: headed(0.5 * math.pi - psi),
    )  # fmt: skip
    yield read(
        "the heading counted clockwise from east", f"`offset` of {key}",
        lambda _: headed(psi + 0.5 * math.pi),
    )  # fmt: skip
    if over_ground:
        yield read(
            "the heading turned round by 180 deg", f"`offset` of {key}",
            lambda _: headed(psi + math.pi),
        )  # fmt: skip
    for factor, words in ANGLES.items():
        heading = _aligned(psi / factor, seen, cut, over_ground)
        yield read(
            f"the heading taken as {words}", f"`unit` of {key}", lambda _, h=heading: headed(h),
            _stated(words, read_as, "heading"),
        )  # fmt: skip
    if profile.sensors.yaw_rate is not None:
        key = "[sensors.yaw_rate]"
        rate = seen.yaw_rate
        yield read(
            "the yaw rate's sign turned round", f"`sign` of {key}",
            lambda s: replace(s, yaw_rate=-rate),
        )  # fmt: skip
        for factor, words in RATES.items():
            yield read(
                f"the yaw rate taken as {words}", f"`unit` of {key}",
                lambda s, f=factor: replace(s, yaw_rate=rate / f),
                _stated(words, read_as, "yaw_rate"),
            )  # fmt: skip
    if profile.sensors.velocity is None:
        yield from _position_signs(read, seen)
    else:
        yield from _velocity_signs(read, seen, cut, over_ground, read_as)


def _position_signs(read: Callable[..., Turned], seen: Sighted) -> Iterator[Turned]:
    """(x₀, -y₀) and (y₀, x₀), of positions whose change is the velocity."""
    key = "[sensors.position]"
    mirrored = np.array([1.0, -1.0])
    yield read(
        "y0 counted to the other side", f"`sign` of {key}",
        lambda s: replace(
            s, position=seen.position * mirrored, velocity=seen.velocity * mirrored
        ),
    )  # fmt: skip
    yield read(
        "x0 and y0 exchanged", f"the order of `fields` of {key}",
        lambda s: replace(s, position=seen.position[:, ::-1], velocity=seen.velocity[:, ::-1]),
    )  # fmt: skip


def _velocity_signs(
    read: Callable[..., Turned],
    seen: Sighted,
    cut: Windows,
    over_ground: bool,
    read_as: Profile | None,
) -> Iterator[Turned]:
    """V over each factor of SPEEDS, and its parts turned round or exchanged: (V₁, -V₂), (V₂, V₁),
    -V; or the velocity of the positions."""
    key = "[sensors.velocity]"
    velocity = seen.velocity
    for factor, words in SPEEDS.items():
        yield read(
            f"the speed taken as {words}", f"`units` of {key}",
            lambda s, f=factor: replace(s, velocity=velocity / f),
            _stated(words, read_as, "velocity"),
        )  # fmt: skip
    if not over_ground:
        yield read(
            "the velocity's athwart part turned round", f"`sign` of {key}",
            lambda s: replace(s, velocity=velocity * np.array([1.0, -1.0])),
        )  # fmt: skip
        yield read(
            "the velocity's two parts exchanged", f"`fields` of {key}",
            lambda s: replace(s, velocity=velocity[:, ::-1]),
        )  # fmt: skip
        return
    yield read(
        "the course counted anticlockwise", f"`sign` of {key}",
        lambda s: replace(s, velocity=velocity * np.array([1.0, -1.0])),
    )  # fmt: skip
    yield read(
        "the course counted from east", f"`kind` or `fields` of {key}",
        lambda s: replace(s, velocity=velocity[:, ::-1]),
    )  # fmt: skip
    yield read(
        "the course turned round by 180 deg", f"`offset` of {key}",
        lambda s: replace(s, velocity=-velocity),
    )  # fmt: skip
    moving = _moving(seen, cut)
    yield read(
        INSTEAD, f"`units` and `sign` of {key}", lambda s: replace(s, velocity=moving)
    )  # fmt: skip


def _moving(seen: Sighted, cut: Windows) -> np.ndarray:
    """(p_{k+1} - p_{k-1})/(t_{k+1} - t_{k-1}) [n, 2] m/s: velocity of the positions over ground."""
    position = seen.position.reshape(*cut.state.shape[:2], 2)
    since = np.pad(np.cumsum(cut.dt, axis=1), ((0, 0), (1, 0)))[..., None]
    rate = np.empty(position.shape)
    rate[:, 1:-1] = (position[:, 2:] - position[:, :-2]) / (since[:, 2:] - since[:, :-2])
    rate[:, 0], rate[:, -1] = rate[:, 1], rate[:, -2]
    return rate.reshape(-1, 2)


def _aligned(heading: np.ndarray, seen: Sighted, cut: Windows, over_ground: bool) -> np.ndarray:
    """ψ + arg Σ (V_N + i V_E) exp(-iψ) [n] rad: a heading whose zero is lost, turned in each window
    so that the ship goes ahead in the mean, as the velocity V over ground goes."""
    if not over_ground:
        return heading
    count, size, _ = cut.state.shape
    north, east = seen.velocity.reshape(count, size, 2).transpose(2, 0, 1)
    each = heading.reshape(count, size)
    along = (north + 1j * east) * np.exp(-1j * each)
    return (each + np.angle(along.sum(1))[:, None]).reshape(-1)


def sufficient_convention(
    simulator: ExtendedSimulator, cut: Windows, nominal: Windows, read_as: Profile | None = None
) -> str:
    """What a convention explains so well that no search for causes is needed: it leaves next to
    nothing of what the trial has more than the nominal voyages. Empty where none does, and where it
    is a cause, too, which is searched for."""
    cut, nominal = simulated(simulator, cut), simulated(simulator, nominal)
    own, level = mean(simulator, cut), mean(simulator, nominal)
    found = try_conventions(simulator, cut, nominal, read_as)
    if found.cause:
        return ""
    if own - found.loss < thresholds.ALL_EXCESS * (own - level):
        return ""
    return sentence(found, own) if explains(found, own, own, _hold(cut), level) else ""


def sentence(found: Tried, own: float) -> str:
    return (
        f"L is {found.loss:.0f} with {found.words} (look at {found.key} in the profile), and "
        f"{own:.0f} as log and profile have it"
    )


def explains(found: Tried, own: float, after: float, hold: float, level: float | None) -> bool:
    """Whether a convention, of mean L', is the explanation: it leaves less than half of the model's
    error, and less than constant velocities have, L' < min(TURNED_SIGN own, hold); and less than
    TURNED_SIGN `after`, or else it takes away most of what the trial has more than the nominal
    voyages, own - L' ≥ MOST_OF_EXCESS (own - level), and no causes leave less, L' ≤ after.

    own, after  mean L as log and profile have it, without and with the named causes
    hold        of constant velocities
    level       of the nominal windows; None without any
    """
    if found.loss >= min(thresholds.TURNED_SIGN * own, hold):
        return False
    if found.loss < thresholds.TURNED_SIGN * after:
        return True
    if level is None or found.loss > after:
        return False
    return own - found.loss >= thresholds.MOST_OF_EXCESS * (own - level)
