"""Which of the shipped profiles a log is of."""

from __future__ import annotations

from shiplog.exceptions import ProfileError, listed
from shiplog.logs.reading.read import Contents
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile


def fitting_profile(found: Contents) -> Profile:
    """The shipped profile that a log names, or whose topics it carries. Raises ProfileError."""
    path = found.path
    ship = found.metadata.get("voyage", {}).get("ship")
    fitting = [
        candidate
        for candidate in map(profiles.load, profiles.shipped())
        if set(candidate.wanted()) <= set(found.topics)
    ]
    named = [candidate for candidate in fitting if candidate.ship.name == ship]
    if len(named or fitting) == 1:
        return (named or fitting)[0]
    topics = listed(found.topics)
    if fitting:
        raise ProfileError(
            f"{path.name} fits several profiles: {listed(c.source for c in fitting)}.",
            hint="say which with --profile.",
        )
    raise ProfileError(
        f"No shipped profile fits {path.name}. Its topics: {topics}.",
        hint=f"draft one with `shiplog profile {path}`, look it over, and give it with --profile.",
    )
