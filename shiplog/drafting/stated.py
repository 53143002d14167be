"""What a recorder itself says of a topic, in the metadata of its channel.

The readers of recorders' files write it (`logs/conversion`): `actuator` (its kind), `unit`,
`offset`, `limits`, `sign`, `direction_deg`, `gear_ratio`, `lever_arm_m`, `sigma`, `primary` of the
instrument that the recorder itself used, `why` and `doubt` for the comments of the lines.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from shiplog.drafting import particulars
from shiplog.drafting.toml_text import in_comment
from shiplog.logs.conversion.write import THE_MESSAGES_OWN
from shiplog.ship_profile.units_of_channels import DRIVEN

Metadata = Mapping[str, str]
NO_SIGMA = "# sigma: neither the record nor the recorder shows it; one standard deviation"


def actuator(metadata: Metadata) -> str:
    """The kind of actuator that a topic is; "" where the log does not say that it is one."""
    kind = metadata.get("actuator", "")
    return kind if kind in DRIVEN else ""


def field(columns: Sequence[str]) -> str:
    """The field of such a topic that holds the value: the message's own are time and frame."""
    return next((one for one in columns if not one.startswith(THE_MESSAGES_OWN)), columns[0])


def is_primary(metadata: Metadata) -> bool:
    return metadata.get("primary") == "1"


def numbers(metadata: Metadata, key: str, count: int) -> list[float]:
    """The numbers of an entry; none where it is not so many."""
    try:
        found = [float(text) for text in metadata.get(key, "").split(",") if text.strip()]
    except ValueError:
        return []
    return found if len(found) == count and all(map(math.isfinite, found)) else []


def lever_arm(metadata: Metadata) -> str:
    """The line on where an antenna stands; "" where the log does not say."""
    place = numbers(metadata, "lever_arm_m", 2)
    if not place:
        return ""
    why = in_comment(metadata.get("lever_arm_why", "of the log"))
    return f"lever_arm_m = [{place[0]!r}, {place[1]!r}]  # {why}"


def sigma(metadata: Metadata, drafted: list[str]) -> list[str]:
    """The lines on accuracy: of the record where it shows one, else of the recorder."""
    if not is_primary(metadata) or not drafted[0].startswith("#"):
        return drafted
    stated = numbers(metadata, "sigma", 1)
    first = f"sigma = {stated[0]!r}  # of the receiver's own estimate" if stated else NO_SIGMA
    return [first, *drafted[1:]]


def actuator_lines(metadata: Metadata, kind: str, unit: str, most: float | None) -> str:
    """The lines of an actuator after its field: how its pulses count, and where it stands."""
    text = ""
    if offset := numbers(metadata, "offset", 1):
        text += f"offset = {offset[0]!r}\n"
    if sign := numbers(metadata, "sign", 1):
        text += f"sign = {sign[0]!r}\n"
    if limits := numbers(metadata, "limits", 2):
        text += f"limits = [{limits[0]!r}, {limits[1]!r}]\n"
    if "gear_ratio" in metadata:
        ratio = numbers(metadata, "gear_ratio", 1) or [1.0]
        text += f"gear_ratio = {ratio[0]!r}  # CHECK: turns of the engine a turn of the propeller\n"
    rest = particulars.of_actuator(kind, unit, most)
    if direction := numbers(metadata, "direction_deg", 1):
        kept = [line for line in rest.splitlines() if not line.startswith("direction_deg")]
        rest = "\n".join([*kept, f"direction_deg = {direction[0]!r}", ""])
    if limits:
        rest = "\n".join(one for one in rest.split("\n") if not one.startswith("# limits"))
    return text + rest


def comment(metadata: Metadata) -> str:
    """Why a topic is drafted as it is, before its other facts."""
    said = [metadata[key] for key in ("doubt", "why") if metadata.get(key)][:1]
    return f"{in_comment(said[0])}; " if said else ""
