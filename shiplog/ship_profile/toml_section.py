"""A section of a TOML file that shiplog reads: of a profile, of a run's configuration."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """Frozen, every key known, every number finite.

    A lever arm of NaN would empty every position of a voyage without a word.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
