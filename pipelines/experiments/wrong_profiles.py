"""Profiles with one wrong unit, sign or place, on the sample logs: which are seen, and by what.

    python -m pipelines.experiments.wrong_profiles
    python -m pipelines.experiments.wrong_profiles --diagnose --out OUT --only "wind"

Each of the 42 is tried in three ways: in both campaigns, in the trial only, in the profile of one
voyage. Without --diagnose the voyages are ingested and nothing is trained; with it, a model of the
right profile judges season 3, in which nothing is hidden, read through the wrong one.

    sensors        the sensors contradict each other
    plausibility   the profile, or the physics of ships, excludes it
    undetermined   the record is as likely with it as without: the last column says why
"""

from __future__ import annotations

import argparse
import copy
import json
import logging
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import tomli_w

from shiplog import profile_file
from shiplog.exceptions import ShiplogError
from shiplog.report import tables
from shiplog.voyages.ingest import ingest

LOGS = Path(__file__).parents[2] / "sample_logs"
NOMINAL, TRIAL, ONE = ("voyage_1", "voyage_3"), ("season3_1", "season3_2"), ("voyage_2",)
SMALL = frozenset({"gap", "spike", "jump", "held"})  # known faults of the sample logs themselves
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


RUDDERS = ("rudder_port", "rudder_starboard")
NO_LIMITS = {"limits": [-1e6, 1e6]}  # a user who gets the unit wrong gets the limits wrong with it


def _exchanged(profile: dict[str, Any]) -> None:
    port, starboard = (a for a in profile["actuators"] if a["name"] in RUDDERS)
    port["topic"], starboard["topic"] = starboard["topic"], port["topic"]


def _at_the_bow(profile: dict[str, Any]) -> None:
    for one in profile["actuators"]:
        if one["name"] in RUDDERS:
            one["position_m"] = [-one["position_m"][0], one["position_m"][1]]


@dataclass(frozen=True)
class Wrong:
    name: str
    edit: Edit
    seen_by: str
    channel: str  # a finding, or what could not be compared, has to name it
    copy: str = ""  # of an undetermined one: another ship or world with the very same record


SAME_RECORD = "no channel of the record changes, and no finding can depend on it"
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
          "a ship whose pivot lies 0.6 m further aft: position and velocity share the antenna"),
    Wrong("rudders to port", _actuators(*RUDDERS, sign=-1.0, **NO_LIMITS), "sensors", "rudder"),
    Wrong("rudders: deg as rad", _actuators(*RUDDERS, unit="rad", **NO_LIMITS), "plausibility",
          "rudder"),
    Wrong("twin rudders exchanged", _exchanged, "undetermined", "rudder",
          "the mirrored order: only the model's flow past each of the two differs"),
    Wrong("shaft: rps as rpm", _actuators("propeller", unit="rpm", **NO_LIMITS), "plausibility",
          "propeller"),
    Wrong("wind: where it blows to", _sensor("wind", offset=[0.0, 180.0]), "undetermined", "wind",
          "a wind from the other side: the ship is too slow for its own motion to tell"),
    Wrong("wind mirrored", _sensor("wind", sign=[1.0, -1.0]), "sensors", "wind"),
    Wrong("wind: m/s as knots", _sensor("wind", units=["kn", "deg"]), "undetermined", "wind",
          "half the wind: the ship is too slow for its own motion to tell"),
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
          "a wind from another quarter: the ship is too slow for its own motion to tell"),
    Wrong("draught of 2.01 m", _ship(draught_m=2.01), "plausibility", "draught"),
    Wrong("rudder of 103 m²", _actuators(*RUDDERS, area_m2=103.0), "plausibility", "rudder"),
    Wrong("propeller of 1 m", _actuators("propeller", diameter_m=1.0), "plausibility",
          "propeller"),
    Wrong("length in feet", _ship(length_m=9.84), "undetermined", "length", SAME_RECORD),
)  # fmt: skip


def text_of(wrong: Wrong | None) -> str:
    """TOML of the sample ship's profile, with one thing wrong."""
    shipped = resources.files("shiplog") / "profiles" / "esso-vectwin.toml"
    content = copy.deepcopy(tomllib.loads(shipped.read_text("utf-8")))
    if wrong is not None:
        wrong.edit(content)
    return tomli_w.dumps(content)


@dataclass(frozen=True)
class Seen:
    """findings and not_compared: those that name the channel."""

    wrong: Wrong
    findings: tuple[str, ...]
    not_compared: tuple[str, ...]
    others: tuple[str, ...]  # that blame another channel

    @property
    def seen_by(self) -> str:
        if any(text.startswith("contradiction") for text in self.findings):
            return "sensors"
        if self.findings:
            return "plausibility"
        return "undetermined" if self.not_compared else "unsaid"


def seen(wrong: Wrong, voyages: tuple[str, ...]) -> Seen:
    """What ingest says of these voyages through the wrong profile."""
    named, open_, others = [], [], []
    for name in voyages:
        try:
            profile = profile_file.parse(text_of(wrong), "wrong profile")
            report = ingest(LOGS / f"{name}.mcap", profile).report
        except ShiplogError as error:
            named.append(f"refused: {error.message}")
            continue
        for finding in report.findings:
            if finding.kind in SMALL:
                continue
            text = f"{finding.kind} {finding.channel} ({finding.reason}): {finding.sentence}"
            (named if wrong.channel in text.lower() else others).append(text)
        for one in getattr(report, "not_compared", ()):
            text = f"{one.what}: {one.reason}"
            if wrong.channel.replace("_", " ") in text.lower().replace("_", " "):
                open_.append(text)
    return Seen(wrong, tuple(named), tuple(open_), tuple(others))


def page(found: list[Seen], ways: str) -> str:
    rows = []
    for one in found:
        said = (one.findings or one.not_compared or ("nothing",))[0]
        rows.append((one.wrong.name, one.wrong.seen_by, one.seen_by, said[:160],
                     "; ".join(other[:60] for other in one.others[:2]) or "-"))  # fmt: skip
    right = sum(one.seen_by == one.wrong.seen_by for one in found)
    named = [one for one in found if one.wrong.seen_by != "undetermined"]
    head = ("wrong", "expected", "seen by", "what is said first", "said of others")
    return (
        f"{ways}: {right} of {len(found)} in the class expected; of the {len(named)} that can be "
        f"seen, {sum(one.seen_by in ('sensors', 'plausibility') for one in named)} are named.\n\n"
        + tables.table(head, rows)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="names that hold this")
    parser.add_argument("--diagnose", action="store_true", help="the trial only, with a verdict")
    parser.add_argument("--out", type=Path, default=Path("wrong_profiles"))
    given = parser.parse_args()
    logging.disable(logging.WARNING)
    chosen = [wrong for wrong in WRONG if given.only in wrong.name]
    if given.diagnose:
        print(_diagnosed(chosen, given.out))
        return
    for ways, voyages in (("both campaigns", NOMINAL), ("the trial only", TRIAL),
                          ("one voyage", ONE)):  # fmt: skip
        print(page([seen(wrong, voyages) for wrong in chosen], ways), end="\n\n")


def _diagnosed(chosen: list[Wrong], out: Path) -> str:
    """The first sentence of the verdict on season 3 read through each wrong profile."""
    from typer.testing import CliRunner

    from shiplog.cli.app import app

    def call(*words: object) -> tuple[int, str]:
        done = CliRunner().invoke(app, [str(word) for word in words])
        failed = "" if done.exception is None else str(done.exception)
        return done.exit_code, f"{done.output}{failed}"

    out.mkdir(parents=True, exist_ok=True)
    store, run = out / "store", out / "run"
    if not run.exists():
        call("ingest", *(LOGS / f"voyage_{i}.mcap" for i in range(1, 5)), "--store", store)
        call("train", "--model", "mmg", "--store", store, "--out", run)
    rows = []
    for number, wrong in enumerate(chosen):
        profile, verdict = out / f"{number}.toml", out / f"{number}.json"
        profile.write_text(text_of(wrong), encoding="utf-8")
        call("ingest", *(LOGS / f"{name}.mcap" for name in TRIAL), "--profile", profile,
             "--store", store)  # fmt: skip
        code, text = call("diagnose", run, "--store", store, "--voyages", "season3_*", "--out",
                          out / f"diagnosis_{number}", "--json", verdict)  # fmt: skip
        content = json.loads(verdict.read_text("utf-8")) if verdict.exists() else {}
        causes = ", ".join(one["name"] for one in content.get("causes", ()))
        first = next((line for line in text.splitlines() if line.strip()), "")
        rows.append((wrong.name, wrong.seen_by, code, content.get("verdict", "-"), causes or "-",
                     first[:200]))  # fmt: skip
    head = ("wrong", "class", "exit", "verdict", "causes", "first sentence")
    return tables.table(head, rows)


if __name__ == "__main__":
    main()
