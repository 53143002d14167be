"""Named coefficients of a physical model: what each one is, where it starts, how far it may go."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from shiplog.exceptions import ProfileError, listed


@dataclass(frozen=True, slots=True)
class ParameterEntry:
    """One coefficient. Its plausible spread is `share` of its value, or `least` where that is more.

    low, high   outside, it is no ship's: refused when read, and a fit stops there
    neutral     the value that leaves its term out, where a ship's file does not name it
    """

    symbol: str
    meaning: str
    share: float
    least: float
    low: float
    high: float
    neutral: float | None = None
    unit: str = "1"


@dataclass(frozen=True)
class Parameters:
    """Names `part.key` in the order of every parameter vector, with start and plausible spread.

    source   where the values are from, for reports
    """

    names: tuple[str, ...]
    values: np.ndarray  # [P]
    spread: np.ndarray  # [P]
    low: np.ndarray  # [P]
    high: np.ndarray  # [P]
    source: str
    entries: tuple[ParameterEntry, ...]  # [P]

    def entry(self, name: str) -> ParameterEntry:
        return self.entries[self.names.index(name)]

    def with_values(self, values: np.ndarray, source: str | None = None) -> Parameters:
        return replace(self, values=np.asarray(values), source=source or self.source)

    def sections(self) -> dict[str, dict[str, float]]:
        """As a TOML has them."""
        out: dict[str, dict[str, float]] = {}
        for name, value in zip(self.names, self.values, strict=True):
            part, key = name.split(".", 1)
            out.setdefault(part, {})[key] = float(value)
        return out

    def to_toml(self) -> str:
        return tomli_w.dumps({"source": self.source, **self.sections()})


def read(path: Path, of: str) -> tuple[dict[str, Any], str]:
    """The sections of a TOML of coefficients, and where they are from. `of`: which model's, for
    messages. Raises ProfileError."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ProfileError(
            f"{path} cannot be read: {error.strerror}.",
            hint=f"give --parameters the path of a TOML of {of} coefficients.",
        ) from error
    except (ValueError, RecursionError) as error:  # also of a number of thousands of digits
        raise ProfileError(f"{path} is not valid TOML: {error}.", hint="mend that line.") from error
    return content, str(content.pop("source", path.name))


def parameters(
    wanted: Mapping[str, ParameterEntry],
    content: Mapping[str, Mapping[str, float]],
    source: str,
    *,
    widen: float = 1.0,
    where: str = "",
    scale: str = "coefficients are non-dimensional",
) -> Parameters:
    """The values that `content` has for the wanted coefficients, or their neutral ones.

    wanted   name → entry, in the order of the parameter vector
    widen    factor on the plausible spreads
    where    the file in question, for messages
    scale    what the coefficients' unit is, for messages

    Raises ProfileError for one that is missing or outside its physical range.
    """
    where = where or source
    values, missing = [], []
    for name, entry in wanted.items():
        part, key = name.split(".", 1)
        value = content.get(part, {}).get(key, entry.neutral)
        if value is None:
            missing.append(name)
        values.append(value)
    if missing:
        parts = sorted({name.split(".")[0] for name in missing} - {"body", "hull"})
        off = f", or leave the force out with --without {' --without '.join(parts)}"
        raise ProfileError(
            f"{where} lacks {listed(missing, most=8)}.",
            hint=f"add them{off if parts else ''}.",
        )
    entries = tuple(wanted.values())
    array = np.array([_number(value) for value in values])
    for (name, entry), value in zip(wanted.items(), array, strict=True):
        if not entry.low <= value <= entry.high:
            raise ProfileError(
                f"{where}: {name} ({entry.symbol}) is {value:g}, outside the physical range "
                f"{entry.low:g} to {entry.high:g}.",
                hint=f"correct its value or sign; {scale}.",
            )
    spread = widen * np.array(
        [max(e.share * abs(v), e.least) for e, v in zip(entries, array, strict=True)]
    )
    low, high = (np.array([getattr(e, side) for e in entries]) for side in ("low", "high"))
    return Parameters(tuple(wanted), array, spread, low, high, source, entries)


def _number(value: float) -> float:
    try:
        return float(value)
    except OverflowError:  # an integer of hundreds of digits
        return math.inf
