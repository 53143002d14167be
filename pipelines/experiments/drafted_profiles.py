"""What a drafted profile is worth: windows of each data set with its draft, of which only the lines
that say CHECK were filled in, beside those of the profile that its owner wrote.

    python -m pipelines.experiments.drafted_profiles DATA [--only NAME ...]

DATA holds a folder for each data set, as for `measured_ships`; none is shipped. A draft is made of
the first source. Exit code 1: a draft gives less than 95 % of the windows.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from shiplog.commands.convert import convert, draft
from shiplog.commands.prepare import expand
from shiplog.report.evaluation import tables
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.ingest.ingest import ingest

ENOUGH = 0.95  # of the windows of the owner's profile
DATA_SETS = {  # folder, what is converted or ingested, the profile of its owner
    "esso-osaka": ("frt-ds-esso", ("random/*", "turning/*", "zigzag/*"), "esso-osaka"),
    "blueboat": ("blueboat_ntnu", ("blueboat_10hz.parquet",), "blueboat"),
    "kvlcc2": ("kvlcc2_simman", ("hsva_cpmc_zigzag_20hz_model.parquet",), "kvlcc2"),
    "kvlcc2, full scale": ("kvlcc2_simman", ("marin_free_fullscale.parquet",),
                           "kvlcc2-full-scale"),
    "milliampere": ("milliampere1_physical", ("nlp1", "maneuvering1", "qp1"), "milliampere"),
    "other_ship": ("other_ship", ("*.mcap",), "other_ship.toml"),
    "catamaran": ("other_families/catamaran", ("*.mcap",), "ship.toml"),
    "supply_vessel": ("other_families/supply_vessel", ("*.mcap",), "ship.toml"),
    "three_metre": ("other_families/three_metre", ("*.mcap",), "ship.toml"),
    "three_metre_b": ("other_families/three_metre_b", ("*.mcap",), "ship.toml"),
}  # fmt: skip


@dataclass(frozen=True)
class Counted:
    """Of all voyages of a data set together."""

    voyages: int
    windows: int
    usable_s: int
    findings: int


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, metavar="DATA")
    parser.add_argument("--only", nargs="+", choices=DATA_SETS, default=list(DATA_SETS))
    given = parser.parse_args()
    rows, few = [], False
    for name in given.only:
        folder, patterns, owner = DATA_SETS[name]
        sources = [p for pattern in patterns for p in sorted((given.data / folder).glob(pattern))]
        path = given.data / folder / owner
        reference = profiles.load(path if path.is_file() else owner)
        filled, asked = fill(draft(sources[0]), reference)
        theirs, ours = count(sources, reference), count(sources, filled)
        few |= ours.windows < ENOUGH * theirs.windows
        rows.append((name, asked, theirs.voyages, theirs.windows, ours.windows,
                     theirs.usable_s, ours.usable_s, theirs.findings, ours.findings))  # fmt: skip
    head = ("data set", "CHECK lines", "voyages", "windows", "with the draft", "usable, s",
            "with the draft", "findings", "with the draft")  # fmt: skip
    print(tables.table(head, rows))
    return int(few)


def count(sources: list[Path], profile: Profile) -> Counted:
    """Convert what is no log, and ingest. Raises ShiplogError."""
    with tempfile.TemporaryDirectory() as folder:
        logs = [path for path in expand(sources) if path.suffix == ".mcap"]
        if tabled := [path for path in sources if path.suffix != ".mcap"]:
            logs += convert(tabled, profile, Path(folder)).logs
        reports = [ingest(log, profile).report for log in logs]
    return Counted(
        len(reports), sum(r.windows or 0 for r in reports), sum(r.usable_s or 0 for r in reports),
        sum(len(r.findings) for r in reports),
    )  # fmt: skip


def fill(text: str, reference: Profile) -> tuple[Profile, int]:
    """A draft whose lines that say CHECK have the values of the owner's profile, where it has any;
    and how many such lines there are. Everything else is as it was drafted."""
    drafted = profiles.parse(text, "draft")
    content = tomllib.loads(text)
    for key in drafted.unchecked:
        for place, name, value in _answers(key, content, drafted, reference):
            place[name] = value
    return profiles.parse(tomli_w.dumps(content), "filled"), len(drafted.unchecked)


def _answers(
    key: str, content: dict[str, Any], drafted: Profile, reference: Profile
) -> Iterator[tuple[dict[str, Any], str, Any]]:
    """(section, name, value) of what the owner's profile says of a key."""
    section, _, rest = key.partition(".")
    owner = reference.model_dump(mode="json", exclude_none=True)
    if section == "ship" and rest in owner["ship"]:
        yield content["ship"], rest, owner["ship"][rest]
    elif section == "sensors":
        name, _, field = rest.partition(".")
        sensor, known = content["sensors"][name], owner["sensors"].get(name, {})
        same = reference.sensors.kind(name) == drafted.sensors.kind(name) if known else False
        if field in known and (same or field == "lever_arm_m"):
            yield sensor, field, known[field]
    elif section == "table" and rest in owner.get("table", {}):
        own, known = content["table"][rest], owner["table"][rest]
        for field in ("unit", "sign", "offset"):
            if field in known and not ({own["channel"], known["channel"]} & {"time", "voyage"}):
                yield own, field, known[field]
    elif section == "actuators":
        name, _, field = rest.rpartition(".")
        own = next(a for a in content["actuators"] if a["name"] == name)
        alike = [a for a in owner["actuators"] if a["topic"] == own["topic"]]
        if alike and field in alike[0]:
            yield own, field, alike[0][field]


if __name__ == "__main__":
    sys.exit(main())
