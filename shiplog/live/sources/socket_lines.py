"""Lines of NMEA 0183 or Signal K over UDP, which is listened to, or TCP, which is connected to.

Each line gets this machine's time of its arrival. A connection that is lost is sought again every
AGAIN_S. A Signal K server sends its ship's values once it was asked for them.
"""

from __future__ import annotations

import contextlib
import json
import socket
from datetime import UTC, datetime
from typing import Any
from urllib.parse import urlsplit

from shiplog.exceptions import ShiplogError, UsageError
from shiplog.live.sources.base import Arrived
from shiplog.live.sources.text_lines import TextLines
from shiplog.nomenclature.units import SECOND_NS

AGAIN_S = 2.0
CONNECTED_S = 0.2  # s that a look may wait for a connection
READ_BYTES = 1 << 16  # of a datagram, or of one read
MOST_READS = 256  # of one look
FIRST_LINES = 20  # a server's greeting, satellites in view: they need not say where a ship is
SUBSCRIBE = {"context": "vessels.self", "subscribe": [{"path": "*", "period": 100}]}


class SocketLines:
    """udp://HOST:PORT is listened to, on this machine unless another address of it is given."""

    def __init__(self, address: str) -> None:
        parts = urlsplit(address)
        try:
            port = parts.port
        except ValueError:
            port = None
        if not parts.hostname or port is None:
            raise UsageError(
                f"{address} names no host and port.", hint="such as udp://127.0.0.1:10110."
            )
        self.name, self.live, self.kind = address, True, parts.scheme
        self.host, self.port = parts.hostname, port
        self.text = TextLines(address)
        self.socket: socket.socket | None = None
        self._tried: int | None = None
        self._was_there = False
        if self.kind == "udp":
            self._listen()

    def _listen(self) -> None:
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            made.bind((self.host, self.port))
        except OSError as error:
            made.close()
            raise ShiplogError(
                f"{self.name} cannot be listened to: {error.strerror}.",
                hint="another program may listen there, or the address is not this machine's.",
            ) from error
        made.setblocking(False)
        self.socket = made

    def look(self, clock: int) -> Arrived:
        notes: list[str] = []
        if self.socket is None:
            self._connect(clock, notes)
        lines = self._lines(clock, notes)
        frames, why = self.text.messages(lines)
        if why and lines and len(self.text.lines) >= FIRST_LINES:
            notes.append(why)
        return Arrived(frames, tuple(notes), topics=frozenset(self.text.given))

    def _connect(self, clock: int, notes: list[str]) -> None:
        if self._tried is not None and clock - self._tried < AGAIN_S * SECOND_NS:
            return
        self._tried = clock
        try:
            made = socket.create_connection((self.host, self.port), CONNECTED_S)
        except OSError as error:
            notes.append(f"{self.name} cannot be reached: {error.strerror or error}. It is tried "
                         "again.")  # fmt: skip
            return
        made.setblocking(False)
        self.socket = made
        if self._was_there:
            notes.append(f"{self.name} was connected again.")
        self._was_there = True

    def _lines(self, clock: int, notes: list[str]) -> list[str]:
        found: list[str] = []
        for _ in range(MOST_READS if self.socket is not None else 0):
            assert self.socket is not None
            try:
                data = self.socket.recv(READ_BYTES)
            except (BlockingIOError, InterruptedError):
                break
            except OSError as error:
                self._lost(notes, error.strerror or str(error))
                break
            if not data and self.kind == "tcp":
                self._lost(notes, "the other side closed it")
                break
            if self.kind == "udp" and not data.endswith(b"\n"):
                data += b"\n"
            found += self.text.split(data)
        return [self._stamped(line, clock) for line in found if line.strip()]

    def _stamped(self, line: str, clock: int) -> str:
        """With the time of its arrival before it, as recorders write it."""
        if not line.lstrip().startswith("{"):
            stamp = datetime.fromtimestamp(clock / SECOND_NS, UTC).isoformat(
                timespec="milliseconds"
            )
            return f"{stamp.replace('+00:00', 'Z')} {line}"
        if '"roles"' in line and self.kind == "tcp" and self.socket is not None:
            with contextlib.suppress(OSError):  # a lost connection shows with the next read
                self.socket.sendall(json.dumps(SUBSCRIBE).encode() + b"\r\n")
        return f"{clock // 1_000_000};I;{line}"

    def _lost(self, notes: list[str], why: str) -> None:
        notes.append(f"The connection to {self.name} was lost: {why}.")
        if self.kind == "tcp" and self.socket is not None:
            self.socket.close()
            self.socket = None

    def place(self) -> dict[str, Any]:
        return {"address": self.name}

    def close(self) -> None:
        if self.socket is not None:
            self.socket.close()
