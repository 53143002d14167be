"""What a user asks of a season: a date of an event, and the limit of a cause."""

from __future__ import annotations

import math
from datetime import UTC, datetime

from shiplog.exceptions import UsageError


def parse_date(text: str) -> datetime:
    """An ISO 8601 date, UTC unless it says otherwise. Raises UsageError."""
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        raise UsageError(
            f"{text!r} is no date.", hint="give it as 2026-05-17, or 2026-05-17T08:00."
        ) from None
    return found if found.tzinfo else found.replace(tzinfo=UTC)


def parse_limit(text: str) -> tuple[str, float]:
    """`thrust_loss=0.9` as cause and value. Raises UsageError."""
    label, _, value = text.partition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not label or not math.isfinite(number):
        raise UsageError(
            f"{text!r} is no limit.", hint="give a cause and a number, such as thrust_loss=0.9."
        )
    return label, number
