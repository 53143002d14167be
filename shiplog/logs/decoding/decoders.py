"""Payloads to columns: one decoder a schema, each around the package that knows its encoding."""

from __future__ import annotations

from mcap.records import Channel, Schema

from shiplog.logs.decoding import json_text, protobuf, ros, ros_definitions
from shiplog.logs.decoding.messages import Decoder, Undecodable

KNOWN = {
    ("protobuf", "protobuf"): protobuf.messages, ("cdr", "ros2msg"): ros.messages,
    ("cdr", "ros2idl"): ros.messages, ("ros1", "ros1msg"): ros.messages,
}  # fmt: skip
UNSTATED = ("", "unknown")  # what rosbag2 writes of a type whose definition it did not find


def decoder(channel: Channel, schema: Schema | None) -> Decoder:
    """The decoder of a channel, or `Undecodable` with the reason."""
    if channel.message_encoding == "json":
        return json_text.Json(schema)
    named = f"message encoding {channel.message_encoding!r}"
    if schema is None:
        raise Undecodable(f"{named} without a schema")
    if channel.message_encoding == "cdr" and schema.encoding in UNSTATED:
        known = ros_definitions.of_its_name(schema)
        if known is None:
            raise Undecodable(f"nothing says what a {schema.name} holds")
        schema = known
    made = KNOWN.get((channel.message_encoding, schema.encoding))
    if made is None:
        raise Undecodable(f"{named} with schema encoding {schema.encoding!r} is not known")
    try:
        return made(schema)
    except Exception as error:  # protobuf and ROS parsers raise what they like
        reason = " ".join(str(error).split())[:160]
        raise Undecodable(
            f"schema {schema.name!r} is broken: {type(error).__name__} {reason}"
        ) from error
