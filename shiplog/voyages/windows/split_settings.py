"""Which voyages train, validate and test, as a run's configuration holds it."""

from __future__ import annotations

from shiplog.ship_profile.toml_section import Section


class Split(Section):
    """Whole voyages; of a single voyage parts by time (`parts`), which share no second."""

    training: tuple[str, ...]
    validation: tuple[str, ...]
    test: tuple[str, ...] = ()
    chosen_by: str = ""
