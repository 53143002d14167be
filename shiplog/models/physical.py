"""What a file of equations answers, so that a model of it is identified, opened and diagnosed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from shiplog.models.coefficients import Parameters
from shiplog.ship_profile.profile import Profile


class Settings(Protocol):
    """Of a run's [physics] section: what its equations depend on."""

    @property
    def without(self) -> Sequence[str]:
        """Forces that are switched off."""
        ...

    @property
    def substeps(self) -> int:
        """Euler steps within each measured one."""
        ...

    @property
    def width(self) -> int:
        """Of a residual network."""
        ...


class Beginning(NamedTuple):
    """Equations of a ship, coefficients to start from, and a sentence for each particular that
    had to be estimated."""

    model: Any
    start: Parameters
    estimates: tuple[str, ...]


@dataclass(frozen=True)
class PhysicalModel:
    """A file of equations gives one as MODEL. Equations are as `window_series.Physical` has them.

    begin    of a profile, settings and a TOML of coefficients (None: published or estimated ones).
             Raises ProfileError where the ship lacks what the equations need
    opened   the equations of a run again, from its profile, settings and the arrays that are kept
             with its coefficients. Raises TypeError where arrays are missing
    lacks    why causes that change forces cannot be tested with it; empty where they can
    """

    begin: Callable[[Profile, Settings, Path | None], Beginning]
    opened: Callable[[Profile, Settings, Mapping[str, np.ndarray]], Any]
    lacks: str = ""
