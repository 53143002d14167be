"""A user's own FMU inside the one that is written: its files, and what C needs in order to ask it.

resources/given/...   the whole of it, unchanged
sources/given.h       opens its library, and asks it for accelerations as `shiplog.foreign.fmu` does
"""

from __future__ import annotations

import hashlib
import io
import platform
import re
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import PurePosixPath
from typing import Any

from shiplog.exceptions import ModelError, UnreadableError
from shiplog.export import compilers
from shiplog.export.compilers import System
from shiplog.export.filled import filled, inert
from shiplog.export.given_simulator import given
from shiplog.foreign.bridge import Bridge
from shiplog.foreign.fmu import CHANNELS, SHORT
from shiplog.foreign.rows import VELOCITIES
from shiplog.foreign.source import Source
from shiplog.training.runs.load_model import ForeignRun

FOLDER = "resources/given"
WINDS = ("wind_speed", "wind_angle", "wind_x0", "wind_y0", "true_wind_speed",
         "true_wind_direction")  # fmt: skip
LONGEST = 200  # letters of a token or of a library's name


@dataclass(frozen=True)
class Unit:
    """facts    of `foreign.fmu_file.description`: token, identifier, value references, ...
    mapping  which of its variables is which channel, with factors to SI
    actuators  of the ship, in the profile's order
    """

    source: Source
    version: int
    exchange: bool
    facts: Mapping[str, Any]
    mapping: Mapping[str, Any]
    actuators: tuple[str, ...]

    @cached_property
    def content(self) -> dict[str, bytes]:
        """Name → bytes of each of its files. Raises UnreadableError for names that leave it, and
        where it is not the file that was given any more."""
        data = self.source.path.read_bytes()
        if hashlib.sha256(data).hexdigest() != self.source.sha256:
            raise UnreadableError(
                f"{self.source.path} was changed meanwhile.", hint="give the same command again."
            )
        found = {}
        with zipfile.ZipFile(io.BytesIO(data)) as zipped:
            for one in zipped.infolist():
                place = PurePosixPath(one.filename.replace("\\", "/"))
                if place.is_absolute() or ".." in place.parts or ":" in one.filename:
                    raise UnreadableError(
                        f"{self.source.name} has a file {inert(one.filename)!r}, which is outside "
                        "of it.",
                        hint="look into the FMU: nothing of it was written.",
                    )
                if not one.is_dir():
                    found[place.as_posix()] = zipped.read(one)
        return found

    def library(self, system: System) -> str | None:
        """The name in it of its library for a system; None where it has none."""
        folder = system.fmi2 if self.version == 2 else system.fmi3
        name = f"binaries/{folder}/{self.facts['identifier']}{system.ending}"
        return name if folder and name in self.content else None

    def header(self, name: str) -> str:
        """given.h of the ship `name`."""
        state, inputs = self.mapping["state"], self.mapping["inputs"]
        begun = [(c, state[c]["start"], state[c]["factor"]) for c in CHANNELS
                 if c in state and state[c]["start"]]  # fmt: skip
        begun += [(i["channel"], i["start"], i["factor"]) for i in inputs if i["start"]]
        moving = [CHANNELS[i] for i in VELOCITIES]
        driven = [(i["channel"], i["variable"], i["factor"]) for i in inputs]
        outputs = [(c, state[c]["output"], state[c]["factor"]) for c in moving]
        placed = [(c, state[c]["output"], state[c]["factor"]) for c in CHANNELS if c in state]
        states = list(self.facts["states"])
        parameters = self.mapping["parameters"].items()
        short = self.facts["inner"] or min(SHORT, float(self.mapping["step"]))
        return filled("given.h", {
            "NAME": name, "FILE": inert(self.source.name), "SHA256": self.source.sha256,
            "FMI": str(self.version), "EXCHANGE": str(int(self.exchange)),
            "IDENTIFIER": _text(self.facts["identifier"]), "TOKEN": _text(self.facts["token"]),
            "SHORT": repr(short), "STATES": str(len(states)),
            "STARTS": self._rows(begun), "INPUTS": self._rows(driven),
            "OUTPUTS": self._rows(outputs),
            "COUNTS": _counts(begun, driven, parameters, placed if self.exchange else ()),
            "PLACES": ", ".join(
                f"{{{self._channel(c)}, {states.index(v)}, {f!r}}}" for c, v, f in placed
            ) if self.exchange else "{0, 0, 1.0}",
            "MOVING": ", ".join(str(states.index(state[c]["output"])) for c in moving)
            if self.exchange else "0, 0, 0",
            "PARAMETERS": ", ".join(self._parameter(*one) for one in parameters)
            or "{0, 0, 0.0}",
        })  # fmt: skip

    def _channel(self, name: str) -> int:
        return (*CHANNELS, *self.actuators, *WINDS).index(name)

    def _rows(self, of: Sequence[tuple[str, str, float]]) -> str:
        """Rows of channel, value reference and factor."""
        rows = (
            f"{{{self._channel(channel)}, {self.facts['references'][variable]}u, {factor!r}}}"
            for channel, variable, factor in of
        )
        return ", ".join(rows) or "{0, 0u, 1.0}"

    def _parameter(self, name: str, value: Any) -> str:
        reference = self.facts["references"][name]
        kind = 1 if isinstance(value, bool) else 2 if name in self.facts["whole"] else 0
        return f"{{{kind}, {reference}u, {float(value)!r}}}"


def of_run(run: ForeignRun) -> Unit:
    """Raises SimulatorError where it was not given, ModelError where it has no library for this
    machine."""
    source, settings = given(run), run.config.foreign
    described = Bridge.describe(source)
    found = Unit(
        source, 3 if str(described["version"]).startswith("3") else 2,
        bool(settings.mapping["exchange"]), described["unit"], settings.mapping,
        tuple(run.profile.actuator_names),
    )  # fmt: skip
    if not re.fullmatch(r"[\w.\-]+", found.facts["identifier"]):
        raise ModelError(
            f"The library of {source.name} is called {inert(found.facts['identifier'])!r}.",
            hint="export it again with a model identifier of letters, digits and _.",
        )
    here = next((s for s in compilers.SYSTEMS if s.fmi3 == compilers.here()), None)
    if here is None or found.library(here) is None:
        raise ModelError(
            f"{source.name} has no library for this machine ({platform.machine()}).",
            hint="export it again for this one.",
        )
    return found


def _counts(begun: Any, driven: Any, parameters: Any, placed: Any) -> str:
    names = ("GIVEN_STARTS", "GIVEN_INPUTS", "GIVEN_PARAMETERS", "GIVEN_PLACES")
    each = (begun, driven, parameters, placed)
    return ", ".join(f"{name} = {len(one)}" for name, one in zip(names, each, strict=True))


def _text(words: str) -> str:
    """A string of C, of a name that may hold anything."""
    if len(words) > LONGEST:
        raise ModelError(
            f"A name of {len(words)} letters in the model description.", hint="look into the FMU."
        )
    return "".join(
        chr(b) if (b < 128 and chr(b).isalnum()) or chr(b) in "{}-_. " else f"\\{b:03o}"
        for b in words.encode("utf-8")
    )
