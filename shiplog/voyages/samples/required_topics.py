"""What a profile reads is in the log, or the user is told what is there instead."""

from __future__ import annotations

from shiplog.exceptions import ChannelMissing, listed, nearest
from shiplog.logs.conversion.ros2_bags import part_of
from shiplog.logs.decoding.fields import is_number
from shiplog.logs.reading.read import Reading, fields
from shiplog.ship_profile.profile import Profile


def require(reading: Reading, profile: Profile) -> None:
    """Every topic and field that the profile names is there, or say which ones are. Raises
    ChannelMissing."""
    log, topics = reading.contents.path.name, reading.contents.topics
    for topic, paths in profile.wanted().items():
        if topic not in topics:
            raise ChannelMissing(
                f"{log} has no topic {topic!r}{nearest(topic, topics)}. "
                f"Topics found: {listed(topics)}.",
                hint="correct the topic in the ship profile, choose another with --profile, or "
                f"draft one with `shiplog profile LOG`{part_of(reading.contents.path)}.",
            )
        reason = reading.health.undecodable.get(topic)
        if reason:
            raise ChannelMissing(
                f"{log}: the topic {topic!r} cannot be decoded: {reason}.",
                hint="record it as protobuf, ROS 2 CDR or JSON.",
            )
        frame = reading.frames.get(topic)
        for path in sorted(paths):
            if frame is not None and path not in frame.columns:
                known = fields(reading.contents.path, [topic]).get(topic, {})
                raise ChannelMissing(
                    f"{log}: the topic {topic!r} has no field {path!r}{nearest(path, known)}. "
                    f"Fields found: {listed(known)}.",
                    hint="correct the field in the ship profile.",
                )
            if frame is not None and not is_number(frame.schema[path]):
                raise ChannelMissing(
                    f"{log}: the field {path!r} of the topic {topic!r} holds "
                    f"{frame.schema[path]}, not one number.",
                    hint=f'name one of its values in the ship profile, as field = "{path}[0]".',
                )
