"""Fields that are read in addition to those that a profile names, where a message has them."""

from __future__ import annotations

from collections.abc import Mapping

from shiplog.logs.reading.senders import Senders
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.samples import orientation, status, two_sources


def wanted(profile: Profile, found: Mapping[str, Senders]) -> dict[str, set[str]]:
    """Topic → field paths: the profile's, x and y of a quaternion, what says that a value is not
    valid, and who sent it where several do. A field that is not there is no error of the reader's.
    """
    asked = profile.wanted()
    for name, source in status.sources(profile):
        asked[source.topic] |= set(orientation.x_and_y(source.paths) or ())
        asked[source.topic] |= status.paths(name, source)
    for topic, paths in two_sources.wanted(found).items():
        asked[topic] |= paths
    return asked
