"""Ship profiles as TOML: read, and in a user's words what is wrong with one.

Unknown keys are refused with the nearest known one, so that a typing error never silently becomes
a default.
"""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path

from pydantic import ValidationError

from shiplog.exceptions import ProfileError, listed, nearest
from shiplog.nomenclature import units
from shiplog.ship_profile import units_of_channels as profile_units
from shiplog.ship_profile.profile import Actuator, Column, Profile, Sensor, Sensors, Ship, Site
from shiplog.ship_profile.table_channels import NEEDED
from shiplog.ship_profile.unchecked_lines import refuse_key, unchecked_lines


def shipped() -> tuple[str, ...]:
    """Names of the profiles that come with shiplog."""
    folder = resources.files("shiplog") / "profiles"
    return tuple(
        sorted(
            f.name.removesuffix(".toml")
            for f in folder.iterdir()
            if f.name.endswith(".toml") and not f.name.endswith(".mmg.toml")
        )
    )


def load(name_or_path: str | Path) -> Profile:
    """A shipped profile by its name, or any by its path. Raises ProfileError."""
    path, name = Path(name_or_path), str(name_or_path)
    own = path.is_file() or (path.exists() and name not in shipped())  # a folder hides no shipped
    if path.suffix == ".toml" or own:
        if not path.is_file():
            raise ProfileError(
                f"The profile {path} is a folder, not a file."
                if path.is_dir()
                else f"There is no profile file {path}.",
                hint=f"shipped profiles: {listed(shipped())}; "
                "or draft one with `shiplog profile LOG`.",
            )
        try:
            text, source = path.read_text(encoding="utf-8"), str(path.resolve())
        except (OSError, UnicodeDecodeError) as error:
            raise ProfileError(
                f"The profile {path} cannot be read: {error}.",
                hint="save it as UTF-8 text, in a file that you may read.",
            ) from error
    else:
        if name not in shipped():
            raise ProfileError(
                f"There is no profile named {name!r}{nearest(name, shipped())}.",
                hint=f"shipped profiles: {listed(shipped())}; or give the path of a .toml, "
                "which `shiplog profile LOG` drafts.",
            )
        text = (resources.files("shiplog") / "profiles" / f"{name}.toml").read_text("utf-8")
        source = name
    return parse(text, source)


def parse(text: str, source: str) -> Profile:
    """A profile from TOML text. Raises ProfileError naming each wrong key."""
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also of a number of thousands of digits
        raise ProfileError(
            f"{source} is not valid TOML: {error}.",
            hint="mend that line; see the shipped profiles.",
        ) from error
    refuse_key(content, source)
    table = content.get("table")
    if isinstance(table, dict):  # `"column" = "channel"` is short for SI values
        content["table"] = {
            k: {"channel": v} if isinstance(v, str) else v for k, v in table.items()
        }
    try:
        found = {"source": source, "unchecked": unchecked_lines(text)}
        profile = Profile.model_validate({**content, **found})
        for item in (*(s for _, s in profile.sensors.items()), *profile.actuators):
            item.scale()  # an unknown unit is reported now, not in the middle of a log
        for column in profile.table.values():
            units.factor(column.unit or "1")
        profile_units.require_fitting(profile)
        return profile
    except ValidationError as error:
        if lacking := _sensors_lacking(error):
            raise ProfileError(
                f"The profile {source} has no {' and no '.join(lacking)}, and shiplog needs "
                f"{' and '.join(NEEDED)} of a ship.",
                hint="; ".join(f"{name}: record {NEEDED[name]}" for name in lacking)
                + ". Where the log has it, add [sensors.NAME] by hand (docs/reference/profile.md).",
            ) from error
        raise ProfileError(
            f"The profile {source} cannot be used: {advice(error)}.",
            hint="mend these keys; the shipped profiles show each of them.",
        ) from error


def _sensors_lacking(error: ValidationError) -> list[str]:
    """The needed sensors that are not there; none where something else is wrong, too."""
    places = [item["loc"] if item["type"] == "missing" else () for item in error.errors()]
    if places == [("sensors",)]:
        return list(NEEDED)
    lacking = [name for name in NEEDED if ("sensors", name) in places]
    return lacking if len(lacking) == len(places) else []


MESSAGES = {  # pydantic's kinds of error in a user's words
    "finite_number": "has to be a finite number",
    "float_type": "has to be a number",
    "float_parsing": "has to be a number",
    "tuple_type": "has to be a list",
    "model_type": "has to be a section of keys",
    "string_type": "has to be a text in quotes",
    "string_pattern_mismatch": "may have letters, digits and underscores only",
    "too_short": "is missing: at least one is needed",
}


def advice(error: ValidationError) -> str:
    """Pydantic's findings in a user's words, with the nearest known key for an unknown one."""
    found: dict[str, list[str]] = {}
    for item in error.errors():
        branch = any(_branch(part) for part in item["loc"])
        place = ".".join(str(part) for part in item["loc"] if not _branch(part)) or "it"
        if item["type"] == "extra_forbidden":
            known = _keys_at(item["loc"][:-1])
            sentence = f"is not a known key{nearest(str(item['loc'][-1]), known)}"
        elif item["type"] == "missing":
            sentence = "is missing"
        elif item["type"] in MESSAGES:
            sentence = MESSAGES[item["type"]]
        else:
            words = item["msg"].removeprefix("Value error, ")
            sentence = words.replace("Input should be", "has to be")
            sentence = sentence if sentence != words else f": {words}"
        if branch and item["type"] in ("float_type", "tuple_type"):
            found.setdefault(place, [])  # a number or a list: the other alternative says more
        else:
            found.setdefault(place, []).append(sentence)
    for place in [p for p in found if any(q.startswith(f"{p}.") for q in found)]:
        if not found[place]:
            del found[place]
    return "; ".join(
        f"{place} {sentence}".replace(" : ", ": ")
        for place, sentences in found.items()
        for sentence in sentences or ["has to be a number or a list of numbers"]
    )


def _branch(part: object) -> bool:
    """Whether pydantic says with it which alternative of a type it tried."""
    return part in ("float", "constrained-float") or str(part).startswith("tuple[")


def _keys_at(location: tuple) -> list[str]:
    sections = {
        "ship": Ship,
        "sensors": Sensors,
        "actuators": Actuator,
        "site": Site,
        "table": Column,
    }
    if not location:
        return [key for key in Profile.model_fields if key not in ("source", "unchecked")]
    section = sections.get(str(location[0]), Profile)
    if section is Sensors and len(location) > 1:
        section = Sensor
    return list(section.model_fields)
