"""A Signal K server over TCP: it is asked for its ship's values once, and they become messages."""

from __future__ import annotations

import json
import math
import socket
import time

import pytest

from shiplog.live.sources import opened
from shiplog.live.sources.socket_lines import AGAIN_S, SocketLines
from shiplog.nomenclature.units import SECOND_NS

NOON = 1_780_000_000 * SECOND_NS
SELF = "vessels.urn:mrn:imo:mmsi:211000000"
HELLO = {
    "name": "server", "version": "2.0.0", "self": SELF, "roles": ["master", "main"],
    "timestamp": "2026-05-28T20:26:40.000Z",
}  # fmt: skip


def delta(second: int) -> bytes:
    """A ship that goes north at 5 m/s and turns by a degree a second; no time of its own."""
    values = {
        "navigation.position": {"latitude": 34.5 + second * 5.0 / 111_120.0, "longitude": 135.5},
        "navigation.speedOverGround": 5.0, "navigation.courseOverGroundTrue": 0.0,
        "navigation.headingTrue": math.radians(second),
    }  # fmt: skip
    update = {"$source": "can0.7", "values": [{"path": p, "value": v} for p, v in values.items()]}
    return json.dumps({"context": SELF, "updates": [update]}).encode() + b"\r\n"


@pytest.fixture
def server():
    with socket.create_server(("127.0.0.1", 0)) as made:
        made.settimeout(5.0)
        yield made


def connected(source: SocketLines, server: socket.socket, clock: int) -> socket.socket:
    source.look(clock)
    other, _ = server.accept()
    other.settimeout(5.0)
    other.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    other.sendall(json.dumps(HELLO).encode() + b"\r\n")
    return other


def looked(source: SocketLines, clock: int) -> dict:
    """What came, waited for: a loopback is quick, and not at once."""
    for _ in range(500):
        if frames := source.look(clock).frames:
            return frames
        time.sleep(0.01)
    return {}


def asked(other: socket.socket) -> dict:
    return json.loads(other.makefile("r").readline())


def test_its_values_become_messages_with_the_time_of_their_arrival(server):
    source = opened(f"tcp://127.0.0.1:{server.getsockname()[1]}", {})
    assert isinstance(source, SocketLines)
    other = connected(source, server, NOON)
    assert not source.look(NOON + 1).notes  # a greeting is nothing wrong
    assert asked(other) == {
        "context": "vessels.self", "subscribe": [{"path": "*", "period": 100}]
    }  # fmt: skip
    headings: dict[int, float] = {}
    speeds: list[float] = []
    for second in range(1, 11):
        whole = delta(second)
        other.sendall(whole[:40])  # half a message waits for the rest of it
        assert not source.look(NOON + second * SECOND_NS - 1).frames
        other.sendall(whole[40:])
        for topic, frame in looked(source, NOON + second * SECOND_NS).items():
            if topic == "/gyro":
                headings |= dict(zip(frame["log_time"], frame["heading_deg"], strict=True))
            if topic == "/gnss/velocity":
                speeds += frame["sog_mps"].to_list()
    other.close()
    source.close()
    assert list(headings.values()) == pytest.approx(list(range(1, 11)))
    assert [(at - NOON) / SECOND_NS for at in headings] == pytest.approx(range(1, 11), abs=0.001)
    assert speeds == pytest.approx([5.0] * 10)


def test_a_server_that_starts_anew_is_asked_again(server):
    source = SocketLines(f"tcp://127.0.0.1:{server.getsockname()[1]}")
    first = connected(source, server, NOON)
    source.look(NOON + 1)
    asked(first)
    first.close()
    notes = [*source.look(NOON + 2).notes, *source.look(NOON + 3).notes]
    assert any("lost" in note for note in notes)
    at = NOON + round(2 * AGAIN_S * SECOND_NS)
    second = connected(source, server, at)
    source.look(at + 1)
    assert asked(second)["context"] == "vessels.self"
    second.sendall(delta(20))
    frames = looked(source, at + SECOND_NS)
    assert frames["/gyro"]["heading_deg"].to_list() == pytest.approx([20.0])
    second.close()
    source.close()
