"""Fields that are read beside those that a profile names, where a message has them."""

from __future__ import annotations

from shiplog.profile import Profile
from shiplog.voyages import orientation, status


def wanted(profile: Profile) -> dict[str, set[str]]:
    """Topic → field paths: the profile's, x and y of a quaternion, and what says that a value is
    not valid. A field that is not there is no error of the reader's."""
    asked = profile.wanted()
    for name, source in status.sources(profile):
        asked[source.topic] |= set(orientation.beside(source.paths) or ())
        asked[source.topic] |= status.paths(name, source)
    return asked
