"""Causes in the instruments: what they show is not what was."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shiplog.models.causes.base import Cause, Parameter, ParameterEstimate
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.sensors import instrument_faults as faults


@dataclass(frozen=True)
class HeadingOffset(Cause):
    """A misaligned compass. Body velocities may come from a sensor fixed to the hull, which needs
    no heading, or from GNSS velocity that the recorder has turned by the compass: `turned`.

    Size: a gyro's settle point error may be 0.75 deg · sec(latitude) (ISO 8728), 2.2 deg at 70 deg,
    and a corrected magnetic compass keeps a deviation of up to 3 deg (ISO 25862).
    """

    turned: bool = False

    name = "heading_offset"
    kind = "sensor"
    story = "The compass is misaligned."
    equation = "ψ_measured = ψ {angle:+.2f} deg"
    remedy = (
        "Check the compass against a bearing, correct its offset in the profile, and "
        "ingest these logs again."
    )
    parameters = (Parameter("angle", "deg", np.radians(2.5), np.radians(0.25)),)
    separated_by = {
        "current": "one full slow turn, or the same course out and back",
        "rudder_offset": "hover and coasting with the propeller stopped: the offset of the rudders "
        "vanishes",
    }

    @property
    def label(self) -> str:
        return f"{self.name}:gnss" if self.turned else self.name

    def compatible(self, label: str) -> bool:
        return label.partition(":")[0] != self.name

    @property
    def needs(self) -> tuple[str, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return ("body velocity",) if self.turned else ()

    def read(self, record: Record, p: np.ndarray) -> Record:
        return faults.without_heading_offset(record, float(p[0]), self.turned)

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"The compass is misaligned by {estimates['angle'].value:+.2f} deg."


@dataclass(frozen=True)
class YawRateBias(Cause):
    """Size: a rate-of-turn indicator may be 0.5 deg/min off (IMO A.526(13)), a small gyro of the
    micromechanical kind tenths of a degree a second when switched on (Titterton & Weston 2004)."""

    name = "yaw_rate_bias"
    kind = "sensor"
    needs = ("yaw rate",)
    story = "The gyro has a bias."
    equation = "r_measured = r {value:+.3f} deg/s"
    remedy = (
        "Check the gyro at rest alongside, correct its zero in the profile, and ingest "
        "these logs again."
    )
    parameters = (Parameter("value", "deg/s", np.radians(0.2), np.radians(0.01)),)
    separated_by = {"yaw_rate_scale": "rest (bias) against steady turns both ways (scale)"}

    def read(self, record: Record, p: np.ndarray) -> Record:
        return faults.without_yaw_rate_bias(record, float(p[0]))

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"The measured yaw rate has a bias of {estimates['value'].value:+.3f} deg/s."


@dataclass(frozen=True)
class YawRateScale(Cause):
    """Size: a rate-of-turn indicator may show 5 % of the rate too much (IMO A.526(13))."""

    name = "yaw_rate_scale"
    kind = "sensor"
    needs = ("yaw rate",)
    story = "The gyro has a scale error."
    equation = "r_measured = {value:.3f} r"
    remedy = (
        "Check the gyro over whole turns, correct its unit in the profile, and ingest "
        "these logs again."
    )
    parameters = (Parameter("value", "1", 0.05, 0.003, low=-0.9),)
    separated_by = {"yaw_rate_bias": "rest (bias) against steady turns both ways (scale)"}

    def read(self, record: Record, p: np.ndarray) -> Record:
        return faults.without_yaw_rate_scale(record, float(p[0]))

    def inverse(self, p: np.ndarray) -> np.ndarray:
        return -p / (1.0 + p)

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {"value": (1.0 + p[..., 0], "1")}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"The measured yaw rate is {estimates['value'].value:.3f} times the true one."


@dataclass(frozen=True)
class ClockOffset(Cause):
    """One channel is late against the heading; `gnss` is position and velocity together. Body
    velocities may be those of a receiver, which the recorder has turned by the present heading:
    `turned`. Late by τ, they show v - τ r u athwart: the drift of a turn is wrong.

    Size: a receiver that reports each second and stamps what arrives is up to a second late (IMO
    MSC.112(73)): 0.58 s in the mean square of such delays."""

    channel: str = "gnss"
    turned: bool = False

    name = "clock_offset"
    kind = "sensor"
    story = "A channel has a clock offset."
    shifts = True
    equation = "measured(t) = true(t - {time:.2f} s)"
    remedy = (
        "Check this channel's clock at the recorder, set `clock` in the profile to the "
        "stamps of measurement, and ingest these logs again."
    )
    parameters = (Parameter("time", "s", 0.6, 0.04, low=-5.0, high=5.0),)
    separated_by = {
        "antenna_offset": "spin on the spot against straight acceleration",
        "clock_offset": "hard acceleration on a straight course",
    }

    @property
    def label(self) -> str:
        return f"{self.name}:{self.channel}" + ("_turned" if self.turned else "")

    @property
    def nominal(self) -> bool:
        # `gnss` is position and velocity together, and of the velocity one form is enough
        return self.channel != "gnss" and not self.turned

    @property
    def varies(self) -> bool:
        # position and velocity have one clock, and what looks like one, as well: one form shows it
        return not self.turned

    def compatible(self, label: str) -> bool:
        """`gnss` is position and velocity together: two of the three determine the third. A
        velocity turned by the heading has a time against the position alone."""
        name, _, other = label.partition(":")
        if name != self.name or {self.channel, other} & {"yaw_rate", "wind"}:
            return label != self.label
        return {self.label, label} == {f"{name}:position", f"{name}:velocity"}

    @property
    def needs(self) -> tuple[str, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        found: tuple[str, ...] = {
            "wind": ("wind", "wind force"), "yaw_rate": ("yaw rate",), "velocity": ("velocity",),
            "gnss": ("velocity",),
        }.get(self.channel, ())  # fmt: skip
        return (*found, "body velocity") if self.turned else found

    def read(self, record: Record, p: np.ndarray) -> Record:
        return faults.without_clock_offset(record, self.channel, float(p[0]), self.turned)

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        late = estimates["time"].value
        what = {"gnss": "position and velocity", "yaw_rate": "the yaw rate"}.get(
            self.channel, f"the {self.channel}"
        )
        what = what[0].upper() + what[1:]
        verb = "are" if self.channel == "gnss" else "is"
        how = "late" if late > 0 else "early"
        by = ", by which the recorder turns it" if self.turned else ""
        return f"{what} {verb} {abs(late):.2f} s {how} against the heading{by}."


@dataclass(frozen=True)
class AntennaOffset(Cause):
    """Size: an arm that nobody entered. A merchant ship's mast stands on the bridge, some 0.3 L
    abaft midship, and off the centreline by up to half the breadth, 0.07 L (IMO SN.1/Circ.227 asks
    for both)."""

    name = "antenna_offset"
    kind = "sensor"
    story = "The antenna is not at its position in the profile."
    equation = "antenna at profile + ({x:+.2f}, {y:+.2f}) m"
    remedy = (
        "Measure where the antenna stands, correct its lever arm in the profile, and "
        "ingest these logs again."
    )
    parameters = (
        Parameter("x", "m", 0.3, 0.015, of="length"),
        Parameter("y", "m", 0.07, 0.015, of="length"),
    )
    separated_by = {"clock_offset": "spin on the spot against straight acceleration"}

    @property
    def renames(self) -> bool:
        return True

    def read(self, record: Record, p: np.ndarray) -> Record:
        return faults.without_antenna_offset(record, float(p[0]), float(p[1]))

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        x, y = estimates["x"].value, estimates["y"].value
        return (
            f"The antenna is {abs(x):.2f} m {'ahead' if x >= 0 else 'astern'} and {abs(y):.2f} m "
            f"to {'starboard' if y >= 0 else 'port'} of its position in the profile."
        )


@dataclass(frozen=True)
class WindDirectionOffset(Cause):
    """Size: 5 deg is the required accuracy of an instrument (WMO-No. 8, Chap. 5); a vane's zero on
    its mast and the flow about the ship make it twice that (Smith, Bourassa & Sharp 1999)."""

    name = "wind_direction_offset"
    kind = "sensor"
    needs = ("wind", "wind force")
    story = "The anemometer is misaligned."
    equation = "γ_measured = γ_A {angle:+.1f} deg"
    remedy = (
        "Check the vane with the bow in the wind, correct its offset in the profile, "
        "and ingest these logs again."
    )
    parameters = (Parameter("angle", "deg", np.radians(10.0), np.radians(1.5)),)
    separated_by = {"current": "one full slow turn; a drifting stop shows the current alone"}

    @property
    def renames(self) -> bool:
        return True

    def read(self, record: Record, p: np.ndarray) -> Record:
        return faults.without_wind_direction_offset(record, float(p[0]))

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"The anemometer is misaligned by {estimates['angle'].value:+.1f} deg."


@dataclass(frozen=True)
class WindSpeedScale(Cause):
    """Size: 10 % is the required accuracy of an instrument (WMO-No. 8, Chap. 5); the flow about a
    bridge is faster by 10 % or more (Moat, Yelland, Pascal & Molland 2005): both, and the height's
    share."""

    name = "wind_speed_scale"
    kind = "sensor"
    needs = ("wind", "wind force")
    story = "The anemometer has a scale error."
    equation = "U_measured = {value:.2f} U_A"
    remedy = (
        "Check the anemometer against a second one, correct its unit in the profile, "
        "and ingest these logs again."
    )
    parameters = (Parameter("value", "1", 0.18, 0.02, low=-0.9),)
    separated_by = {"wind_force": "a second anemometer, or fast straight runs in calm"}

    @property
    def absorbed(self) -> bool:
        return True

    def read(self, record: Record, p: np.ndarray) -> Record:
        return faults.without_wind_speed_scale(record, float(p[0]))

    def inverse(self, p: np.ndarray) -> np.ndarray:
        return -p / (1.0 + p)

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {"value": (1.0 + p[..., 0], "1")}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"The measured wind speed is {estimates['value'].value:.2f} times the true one."
