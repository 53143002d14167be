"""A Foxglove WebSocket: what a bridge of ROS, or a program of one's own, publishes.

Of the protocol (foxglove/ws-protocol, v1, and its successor foxglove.sdk.v1) a reader needs four
messages: `advertise` and `unadvertise` of channels with their schemas, `subscribe`, and message
data, a binary frame

    1 byte 0x01, uint32 subscription, uint64 time [ns], payload        little endian

A schema comes as text, of protobuf as base64 of its descriptors. Channels and messages then are as
those of an MCAP file. The connection lives in a thread, which only fills a queue of bounded length;
one that is lost is sought again.
"""

from __future__ import annotations

import base64
import binascii
import contextlib
import importlib
import json
import queue
import struct
import threading
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from mcap.records import Channel, Message, Schema

from shiplog.exceptions import ShiplogError
from shiplog.live.messages import Decoding
from shiplog.live.sources.base import Arrived
from shiplog.logs.mcap_file.container import Survey

PROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
AGAIN_S = 2.0
MOST_WAITING = 200_000  # frames between two looks: more are dropped, and counted
DATA = struct.Struct("<BIQ")
BASE64 = ("protobuf", "flatbuffer")  # schema encodings that are bytes


class Foxglove:
    """Subscribes to the topics of the profile, whenever they are advertised."""

    def __init__(self, address: str, wanted: Mapping[str, Collection[str]]) -> None:
        try:
            client = importlib.import_module("websockets.sync.client")
        except ImportError as error:
            raise ShiplogError(
                "A Foxglove WebSocket needs the library websockets, which is not installed.",
                hint="pip install 'shiplog[watch]' brings it.",
            ) from error
        self.name, self.live, self.wanted = address, True, wanted
        self.found = Survey(Path(address), 0)
        self.decoding = Decoding(self.found, wanted)
        self.topics: set[str] = set()
        self._numbers: dict[int, int] = {}  # the server's channel → ours
        self._frames: queue.Queue[Any] = queue.Queue(MOST_WAITING)
        self._dropped = 0
        self._closing = threading.Event()
        self._open: Any = None
        self._connect = client.connect
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    # --- in the thread: nothing but frames into the queue -------------------------------------

    def _follow(self) -> None:
        while not self._closing.is_set():
            try:
                with self._connect(
                    self.name, subprotocols=PROTOCOLS, max_size=None, open_timeout=AGAIN_S
                ) as opened:  # type: ignore[arg-type]  # its own alias of str for a protocol's name
                    self._open = opened
                    self._put(None)
                    for frame in opened:
                        self._put(frame)
                why = "the other side closed it"
            except Exception as error:  # of the library, of TLS, of the system: all mean the same
                why = str(error) or type(error).__name__
            self._open = None
            if not self._closing.is_set():
                self._put(ConnectionError(why))
            self._closing.wait(AGAIN_S)

    def _put(self, item: Any) -> None:
        try:
            self._frames.put_nowait(item)
        except queue.Full:
            self._dropped += 1

    # --- by whoever looks ---------------------------------------------------------------------

    def look(self, clock: int) -> Arrived:
        notes: list[str] = []
        messages: list[Message] = []
        for _ in range(self._frames.qsize()):
            item = self._frames.get_nowait()
            if item is None:
                self._numbers.clear()
            elif isinstance(item, ConnectionError):
                notes.append(f"The connection to {self.name} failed: {item}. It is tried again.")
            elif isinstance(item, str):
                self._control_message(item, notes)
            elif (message := self._message(item)) is not None:
                messages.append(message)
        if self._dropped:
            notes.append(f"{self._dropped} messages of {self.name} came faster than they are read.")
            self._dropped = 0
        frames = self.decoding.frames([messages]) if messages else {}
        return Arrived(frames, tuple(notes), topics=frozenset(self.topics))

    def _control_message(self, text: str, notes: list[str]) -> None:
        try:
            message = json.loads(text)
            kind = message.get("op")
            if kind == "advertise":
                self._advertised(message["channels"])
            elif kind == "unadvertise":
                for number in message["channelIds"]:
                    self._numbers.pop(int(number), None)
            elif kind == "status" and message.get("level", 0) > 0:
                notes.append(f"{self.name} says: {str(message.get('message'))[:200]}.")
        except (ValueError, KeyError, TypeError, AttributeError):
            notes.append(f"{self.name} sent a message that is not of its protocol.")

    def _advertised(self, channels: list[dict[str, Any]]) -> None:
        asked = []
        for one in channels:
            topic, number = str(one["topic"]), int(one["id"])
            self.topics.add(topic)
            if topic not in self.wanted:
                continue
            ours = len(self.found.channels) + 1
            encoding = str(one.get("schemaEncoding") or _usual(str(one["encoding"])))
            self.found.schemas[ours] = Schema(
                id=ours, name=str(one.get("schemaName", "")), encoding=encoding,
                data=_schema(str(one.get("schema", "")), encoding),
            )  # fmt: skip
            self.found.channels[ours] = Channel(
                id=ours, topic=topic, message_encoding=str(one["encoding"]), metadata={},
                schema_id=ours,
            )  # fmt: skip
            self._numbers[number] = ours
            asked.append({"id": number, "channelId": number})
        if asked and self._open is not None:
            with contextlib.suppress(Exception):  # a lost connection shows in the thread
                self._open.send(json.dumps({"op": "subscribe", "subscriptions": asked}))

    def _message(self, frame: bytes) -> Message | None:
        if len(frame) < DATA.size or frame[0] != 1:
            return None
        _, number, time = DATA.unpack_from(frame)
        ours = self._numbers.get(number)
        if ours is None:
            return None
        return Message(ours, time, bytes(frame[DATA.size :]), time, 0)

    def place(self) -> dict[str, Any]:
        return {"address": self.name}

    def close(self) -> None:
        self._closing.set()
        if self._open is not None:
            with contextlib.suppress(Exception):
                self._open.close()
        self._thread.join(AGAIN_S)


def _usual(encoding: str) -> str:
    """The schema encoding of a message encoding, of servers that do not name it."""
    return {"protobuf": "protobuf", "cdr": "ros2msg", "ros1": "ros1msg"}.get(
        encoding, "jsonschema"
    )  # fmt: skip


def _schema(text: str, encoding: str) -> bytes:
    if encoding in BASE64:
        try:
            return base64.b64decode(text, validate=True)
        except (binascii.Error, ValueError):
            return b""
    return text.encode()
