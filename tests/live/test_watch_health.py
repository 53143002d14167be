"""Silence, clocks, sockets and connections that are lost: said, and survived."""

from __future__ import annotations

import json
import socket
import struct
import threading

import pytest

from shiplog.live.health import Health, Heard
from shiplog.live.sources import opened
from shiplog.live.sources.socket_lines import AGAIN_S, SocketLines
from shiplog.live.sources.text_file import TextFile
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.units import SECOND_NS

NOON = 1_780_000_000 * SECOND_NS


def sentence(body: str) -> str:
    total = 0
    for character in body:
        total ^= ord(character)
    return f"${body}*{total:02X}"


def second(number: int) -> list[str]:
    """The sentences of one second of a ship that goes north at 5 kn."""
    of_day = f"{12 + number // 3600:02d}{number // 60 % 60:02d}{number % 60:02d}.00"
    minutes = 30.0 + number * 5.0 / 3600.0
    return [
        sentence(f"GPRMC,{of_day},A,34{minutes:08.5f},N,13531.00000,E,5.0,0.0,280526,,,A"),
        sentence(f"HEHDT,{number % 5 / 10:.1f},T"),
        sentence("WIMWV,45.0,R,6.0,M,A"),
    ]


def headings_of(arrived) -> int:
    return sum(f.height for f in arrived.frames.values() if "heading_deg" in f.columns)


def test_a_silent_channel_is_said_once_and_so_is_its_return():
    health = Health()
    last = NOON
    heard = {"yaw_rate": Heard(last, 0.1), "wind": Heard(last, 1.0)}
    assert health.channels(heard, last + SECOND_NS) == []
    (notice,) = health.channels(heard, last + 3 * SECOND_NS)
    assert (notice.channel, notice.over) == ("yaw_rate", False) and "3.0 s" in notice.sentence
    assert health.channels(heard, last + 4 * SECOND_NS) == []
    assert health.bad == ["yaw_rate"]
    back = {name: Heard(last + 5 * SECOND_NS, one.period_s) for name, one in heard.items()}
    (notice,) = health.channels(back, last + 5 * SECOND_NS)
    assert notice.over and health.bad == []


def test_a_value_that_repeats_for_a_moment_is_no_fault():
    def held(seconds: float, unit: str = "s") -> Finding:
        return Finding("held", "position", f"position repeats for {seconds:.1f} s from 1.0 s.",
                       1.0, 1.0 + seconds, seconds, unit=unit)  # fmt: skip

    health = Health()
    assert health.faults([held(0.8), held(40.0, "times")], 0.0, NOON) == []
    (notice,) = health.faults([held(4.0)], 0.0, NOON)
    assert notice.sentence == "position repeats." and health.bad == ["position"]
    (notice,) = health.faults([held(4.0)], 10.0, NOON)  # it ended before what is now
    assert notice.over and health.bad == []


def test_a_source_that_stops_and_a_clock_that_is_ahead_are_said():
    health = Health()
    assert health.arrivals(NOON, NOON + 4 * SECOND_NS, "it") == []
    (silent,) = health.arrivals(NOON, NOON + 6 * SECOND_NS, "it")
    (again,) = health.arrivals(NOON + 7 * SECOND_NS, NOON + 7 * SECOND_NS, "it")
    assert "6 s" in silent.sentence and again.over
    (ahead,) = health.clock(NOON + 3 * SECOND_NS, NOON, live=True)
    assert "3.0 s ahead" in ahead.sentence
    assert health.clock(NOON, NOON, live=True)[0].over
    assert health.clock(NOON, NOON + 3600 * SECOND_NS, live=False) == []  # a file read again
    assert "3600 s old" in health.clock(NOON, NOON + 3600 * SECOND_NS, live=True)[0].sentence


def test_a_text_that_grows_gives_each_message_once(tmp_path):
    path = tmp_path / "growing.nmea"
    path.write_text("")
    source, headings = TextFile(path), 0
    for number in range(30):
        with path.open("a") as stream:
            text = "\r\n".join(second(number)) + "\r\n"
            stream.write(text[:-9] if number % 2 else text)  # half a sentence
        arrived = source.look(NOON)
        headings += headings_of(arrived)
        if number % 2:
            with path.open("a") as stream:
                stream.write(text[-9:])
    arrived = source.look(NOON)
    headings += headings_of(arrived)
    assert headings in (29, 30)  # that of the first second may come before any date is known
    path.write_text("\r\n".join(second(40)) + "\r\n")
    assert source.look(NOON).anew


def test_datagrams_become_messages_with_the_time_of_their_arrival():
    source = opened("udp://127.0.0.1:0", {})
    assert isinstance(source, SocketLines) and source.socket is not None
    address = source.socket.getsockname()
    assert address[0] == "127.0.0.1"
    frames, sender = {}, socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for number in range(10):
        for line in second(number):
            sender.sendto(line.encode(), address)
        arrived = source.look(NOON + number * SECOND_NS)
        frames |= arrived.frames
    sender.close()
    source.close()
    assert any("heading_deg" in frame.columns for frame in frames.values())
    (fix,) = [frame for frame in frames.values() if "latitude" in frame.columns]
    assert fix["latitude"][-1] == pytest.approx(34.5, abs=0.01)


def test_a_lost_connection_is_sought_again():
    server = socket.create_server(("127.0.0.1", 0))
    port = server.getsockname()[1]
    source = SocketLines(f"tcp://127.0.0.1:{port}")
    source.look(NOON)
    other, _ = server.accept()
    other.sendall(("\r\n".join(second(0)) + "\r\n").encode())
    other.close()
    notes = [*source.look(NOON + 1).notes, *source.look(NOON + 2).notes]
    assert any("lost" in note for note in notes)
    server.close()
    at = NOON + round(2 * AGAIN_S * SECOND_NS)
    assert any("cannot be reached" in note for note in source.look(at).notes)
    server = socket.create_server(("127.0.0.1", port))
    at += round(2 * AGAIN_S * SECOND_NS)
    assert any("again" in note for note in source.look(at).notes)
    server.close()
    source.close()


def test_a_foxglove_server_that_goes_and_comes():
    sync = pytest.importorskip("websockets.sync.server")
    from shiplog.live.sources.foxglove import Foxglove

    def serve(connection):
        channel = {"id": 7, "topic": "/gyro", "encoding": "json", "schemaName": "Gyro",
                   "schema": json.dumps({"type": "object", "properties": {
                       "heading_deg": {"type": "number"}}})}  # fmt: skip
        connection.send(json.dumps({"op": "advertise", "channels": [channel]}))
        connection.send("{not of the protocol")
        asked = json.loads(connection.recv())
        number = asked["subscriptions"][0]["id"]
        for at in range(3):
            payload = json.dumps({"heading_deg": 10.0 + at}).encode()
            connection.send(struct.pack("<BIQ", 1, number, NOON + at) + payload)

    protocols = ["foxglove.websocket.v1"]
    with sync.serve(serve, "127.0.0.1", 0, subprotocols=protocols) as server:
        port = server.socket.getsockname()[1]
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        source = Foxglove(f"ws://127.0.0.1:{port}", {"/gyro": {"heading_deg"}})
        values, notes = [], []
        while not any("failed" in note for note in notes):  # the server hangs up after three
            arrived = source.look(NOON)
            notes += arrived.notes
            values += [v for f in arrived.frames.values() for v in f["heading_deg"].to_list()]
        source.close()
        server.shutdown()
    assert values == [10.0, 11.0, 12.0]
    assert any("not of its protocol" in note for note in notes)
