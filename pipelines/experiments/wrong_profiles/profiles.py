"""Profiles of the sample ship with one wrong unit, sign or place each, and what is to see them."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from typing import Any

import tomli_w

Edit = Callable[[dict[str, Any]], None]


def _sensor(name: str, **keys: Any) -> Edit:
    return lambda profile: profile["sensors"][name].update(keys)


def _ship(**keys: Any) -> Edit:
    return lambda profile: profile["ship"].update(keys)


def _actuators(*names: str, **keys: Any) -> Edit:
    def edit(profile: dict[str, Any]) -> None:
        for one in profile["actuators"]:
            if one["name"] in names:
                one.update(keys)

    return edit


def _both(*edits: Edit) -> Edit:
    def edit(profile: dict[str, Any]) -> None:
        for one in edits:
            one(profile)

    return edit


def _without(*keys: str) -> Edit:
    def edit(profile: dict[str, Any]) -> None:
        for key in keys:
            del profile["ship"][key]

    return edit


RUDDERS = ("rudder_port", "rudder_starboard")
NO_LIMITS = {"limits": [-1e6, 1e6]}  # a user who gets the unit wrong gets the limits wrong with it


def _exchanged(*keys: str) -> Edit:
    def edit(profile: dict[str, Any]) -> None:
        port, starboard = (a for a in profile["actuators"] if a["name"] in RUDDERS)
        for key in keys:
            port[key], starboard[key] = starboard[key], port[key]

    return edit


def _at_the_bow(profile: dict[str, Any]) -> None:
    for one in profile["actuators"]:
        if one["name"] in RUDDERS:
            one["position_m"] = [-one["position_m"][0], one["position_m"][1]]


@dataclass(frozen=True)
class Wrong:
    """seen_by   "sensors", "plausibility" or "undetermined"
    channel   a finding has to name it
    copy      of an undetermined one: another ship or world with the very same record
    listed    the words by which it is listed as not compared; the channel where empty
    """

    name: str
    edit: Edit
    seen_by: str
    channel: str
    copy: str = ""
    listed: str = ""


WRONG = (
    # The 22 that a new user tried.
    Wrong("latitude and longitude swapped", _sensor("position", fields=["longitude", "latitude"]),
          "plausibility", "position"),
    Wrong("heading: deg as rad", _sensor("heading", unit="rad"), "sensors", "heading"),
    Wrong("heading anticlockwise", _sensor("heading", sign=-1.0), "sensors", "heading"),
    Wrong("heading + 7 deg", _sensor("heading", offset=-7.0), "undetermined", "heading",
          "a ship that sails with 7 deg more of leeway: velocity is over ground"),
    Wrong("yaw rate to port", _sensor("yaw_rate", sign=-1.0), "sensors", "yaw_rate"),
    Wrong("yaw rate: deg/s as deg/min", _sensor("yaw_rate", unit="deg/min"), "sensors",
          "yaw_rate"),
    Wrong("course: deg as rad", _sensor("velocity", units=["m/s", "rad"]), "sensors", "velocity"),
    Wrong("speed: m/s as knots", _sensor("velocity", units=["kn", "deg"]), "sensors", "velocity"),
    Wrong("lever arm turned round", _both(_sensor("position", lever_arm_m=[-0.3, 0.0]),
          _sensor("velocity", lever_arm_m=[-0.3, 0.0])), "undetermined", "position",
          "a ship whose midship lies 0.6 m further ahead: position and velocity share the antenna",
          "place of the antenna"),
    Wrong("rudders to port", _actuators(*RUDDERS, sign=-1.0, **NO_LIMITS), "sensors", "rudder"),
    Wrong("rudders: deg as rad", _actuators(*RUDDERS, unit="rad", **NO_LIMITS), "plausibility",
          "rudder"),
    Wrong("twin rudders exchanged", _exchanged("topic"), "plausibility", "rudder"),
    Wrong("shaft: rps as rpm", _actuators("propeller", unit="rpm", **NO_LIMITS), "plausibility",
          "propeller"),
    Wrong("wind: where it blows to", _sensor("wind", offset=[0.0, 180.0]), "undetermined", "wind",
          "a wind from the other side: the ship is too slow for its own motion to tell",
          "blows from or to"),
    Wrong("wind mirrored", _sensor("wind", sign=[1.0, -1.0]), "sensors", "wind"),
    Wrong("wind: m/s as knots", _sensor("wind", units=["kn", "deg"]), "undetermined", "wind",
          "half the wind: the ship is too slow for its own motion to tell", "wind's unit"),
    Wrong("length 30 m", _ship(length_m=30.0), "plausibility", "length"),
    Wrong("length 300 m", _ship(length_m=300.0), "plausibility", "length"),
    Wrong("mass in tonnes", _ship(mass_kg=0.2446), "plausibility", "mass"),
    Wrong("propeller of 100 m", _actuators("propeller", diameter_m=100.0), "plausibility",
          "propeller"),
    Wrong("rudders at the bow", _at_the_bow, "plausibility", "rudder"),
    Wrong("breadth of 4.89 m", _ship(breadth_m=4.89), "plausibility", "breadth"),
    # Twenty more.
    Wrong("speed: m/s as km/h", _sensor("velocity", units=["km/h", "deg"]), "sensors", "velocity"),
    Wrong("speed: m/s as cm/s", _sensor("velocity", units=["cm/s", "deg"]), "sensors", "velocity"),
    Wrong("speed times 3.6", _sensor("velocity", sign=[3.6, 1.0]), "sensors", "velocity"),
    Wrong("course anticlockwise", _sensor("velocity", sign=[1.0, -1.0]), "sensors", "velocity"),
    Wrong("course + 90", _sensor("velocity", offset=[0.0, -90.0]), "sensors", "velocity"),
    Wrong("course reversed", _sensor("velocity", offset=[0.0, 180.0]), "sensors", "velocity"),
    Wrong("heading + 90", _sensor("heading", offset=-90.0), "sensors", "heading"),
    Wrong("heading reversed", _sensor("heading", offset=180.0), "sensors", "heading"),
    Wrong("heading from east, anticlockwise", _sensor("heading", sign=-1.0, offset=90.0),
          "sensors", "heading"),
    Wrong("yaw rate: deg/s as rad/s", _sensor("yaw_rate", unit="rad/s"), "sensors", "yaw_rate"),
    Wrong("yaw rate times 60", _sensor("yaw_rate", sign=60.0), "sensors", "yaw_rate"),
    Wrong("longitude to the west", _sensor("position", sign=[1.0, -1.0]), "sensors", "position"),
    Wrong("latitude to the south", _sensor("position", sign=[-1.0, 1.0]), "sensors", "position"),
    Wrong("propeller turns the other way", _actuators("propeller", sign=-1.0, **NO_LIMITS),
          "sensors", "propeller"),
    Wrong("shaft: rps times 60", _actuators("propeller", sign=60.0, **NO_LIMITS), "plausibility",
          "propeller"),
    Wrong("wind angle + 90", _sensor("wind", offset=[0.0, -90.0]), "undetermined", "wind",
          "a wind from another quarter: the ship is too slow for its own motion to tell",
          "vane's zero"),
    Wrong("draught of 2.01 m", _ship(draught_m=2.01), "plausibility", "draught"),
    Wrong("rudder of 103 m²", _actuators(*RUDDERS, area_m2=103.0), "plausibility", "rudder"),
    Wrong("propeller of 1 m", _actuators("propeller", diameter_m=1.0), "plausibility",
          "propeller"),
    Wrong("length in feet", _ship(length_m=9.84), "plausibility", "length"),
    # Two of these once more, where the profile has nothing that tells.
    Wrong("twin rudders exchanged, with their limits", _exchanged("topic", "limits"),
          "undetermined", "rudder", "two rudders in the other order: side by side they turn the "
          "ship alike"),
    Wrong("length in feet, no block coefficient",
          _both(_ship(length_m=9.84), _without("block_coefficient")), "undetermined", "length",
          "a ship of 9.84 m, more slender: no channel of the record is made of the length"),
)  # fmt: skip


def text_of(wrong: Wrong | None) -> str:
    """TOML of the sample ship's profile, with one thing wrong."""
    shipped = resources.files("shiplog") / "profiles" / "esso-vectwin.toml"
    content = copy.deepcopy(tomllib.loads(shipped.read_text("utf-8")))
    if wrong is not None:
        wrong.edit(content)
    return tomli_w.dumps(content)
