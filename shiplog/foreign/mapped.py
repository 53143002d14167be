"""An FMU's mapping: the file that was given, else one next to the FMU, drafted where none is."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

from shiplog.foreign import mapping
from shiplog.foreign.bridge import Bridge
from shiplog.foreign.mapping import Description
from shiplog.foreign.source import SimulatorError, Source
from shiplog.machine import files
from shiplog.ship_profile.profile import Profile
from shiplog.ship_profile.unchecked_lines import unchecked_lines

log = logging.getLogger(__name__)


def of(source: Source, profile: Profile, given: Path | None, unchecked: bool) -> dict[str, Any]:
    """The mapping as a child takes it. A new draft without a doubt is used at once. Raises
    SimulatorError for one that is to be looked over first."""
    description = Description.from_record(Bridge.describe(source))
    path = given or source.path.with_suffix(".toml")
    if not path.exists():
        text = mapping.draft(description, profile)
        files.write_text(path, text)
        doubts = unchecked_lines(text)
        log.info("%s: drafted from the model description", path)
        if doubts:
            raise SimulatorError(
                f"{path} was drafted from {source.name}, and {len(doubts)} of its lines say CHECK.",
                hint="look at these lines, take the CHECK away, and give the same command again.",
            )
    return mapping.load(path, description, profile, unchecked)
