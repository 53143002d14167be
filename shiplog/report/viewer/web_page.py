"""Rerun's viewer in a browser of this machine, on a page that asks nobody else for anything.

Rerun's own page takes its font from a host elsewhere: findings/rerun_web_page_asks_google.sh. This
one is ours. It loads only Rerun's program, and its Content-Security-Policy forbids the browser any
other address, whatever that program asks for.
"""

from __future__ import annotations

import json
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self' 'wasm-unsafe-eval'",  # the viewer is a WebAssembly program
        "connect-src 'self'",
        "style-src 'self'",
        "img-src 'self' data: blob:",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "X-DNS-Prefetch-Control": "off",  # a policy does not speak of looking a name up
    "Cache-Control": "no-store",  # the next recording has the same address
}
PROGRAM = {"re_viewer.js": "text/javascript", "re_viewer_bg.wasm": "application/wasm"}
RECORDING = "recording.rrd"
PAUSED = 1  # of viewer_control.v1alpha1.PlayState

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>shiplog</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="page.css">
<script src="re_viewer.js"></script>
<script src="start.js" defer></script>
</head>
<body><canvas id="viewer"></canvas><p id="message">The viewer is loading.</p></body>
</html>
"""
STYLE = """html, body { margin: 0; height: 100%; overflow: hidden; background: #fafafa; }
canvas { position: absolute; top: 0; left: 0; width: 100%; height: 100%; }
#message { position: absolute; top: 45%; width: 100%; text-align: center; font-family: sans-serif; }
"""
START = """const settings = {
  url: [new URL("recording.rrd", location).href],
  hide_welcome_screen: true,
  enable_history: false,
  persist: false,
  notebook: false,
  theme: "light",
};
const state = document.documentElement.dataset;

function failed(error) {
  state.shiplog = "failed";
  document.getElementById("message").textContent = `The viewer did not start: ${error}`;
}

// The recording is loaded after the program has started, so the moment is asked for again until
// the viewer knows its time line.
async function seek(handle, request) {
  for (let i = 0; i < 600; i += 1) {
    try {
      await handle.viewer_control(new Uint8Array(request));
      return;
    } catch (error) {
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }
}

async function start() {
  const moment = await (await fetch("moment.json")).json();
  await wasm_bindgen({ module_or_path: fetch("re_viewer_bg.wasm") });
  const handle = new wasm_bindgen.WebHandle(settings);
  window.viewer = handle;
  await handle.start(document.getElementById("viewer"));
  document.getElementById("message").remove();
  if (moment !== null) {
    await seek(handle, moment);
  }
  state.shiplog = "shown";
}

start().catch(failed);
"""


def cursor_at(timeline: str, seconds: float) -> list[int]:
    """The bytes that set the viewer's cursor, as Rerun 0.41's viewer control takes them.

    A ViewerControlRequest with set_time_cursor (6): timeline (2) with its name (1), time (3) with
    its nanoseconds (1), play_state (5).
    """
    name = _field(2, _field(1, timeline.encode()))
    time = _field(3, bytes((1 << 3,)) + _varint(round(seconds * 1e9) % 2**64))
    return list(_field(6, name + time + bytes((5 << 3, PAUSED))))


def _field(number: int, content: bytes) -> bytes:
    """A length-delimited field of a protobuf message."""
    return bytes((number << 3 | 2,)) + _varint(len(content)) + content


def _varint(number: int) -> bytes:
    found = bytearray()
    while number >= 128:
        found.append(number & 127 | 128)
        number >>= 7
    return bytes((*found, number))


class Page:
    """The page of one recording, served until `stop`."""

    def __init__(
        self, host: str, port: int, recording: Path, program: dict[str, bytes],
        moment: list[int] | None = None,
    ) -> None:  # fmt: skip
        """program   name of PROGRAM → content; moment   as of `cursor_at`"""
        self._server = ThreadingHTTPServer((host, port), _Handler)
        self._server.daemon_threads = True
        self._server.page = self  # type: ignore[attr-defined]
        self.recording = recording
        self.files: dict[str, tuple[str, bytes]] = {
            "": ("text/html; charset=utf-8", PAGE.encode()),
            "page.css": ("text/css", STYLE.encode()),
            "start.js": ("text/javascript", START.encode()),
            "moment.json": ("application/json", json.dumps(moment).encode()),
            **{name: (PROGRAM[name], content) for name, content in program.items()},
        }
        address = f"{host}:{self._server.server_port}"
        self.address = f"http://{address}/"
        # another name for this machine is a page elsewhere that wants to read the recording
        self.hosts = (address, f"localhost:{self._server.server_port}")
        self._thread = Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Until the user ends it with Ctrl-C."""
        while self._thread.is_alive():
            self._thread.join(1.0)

    def stop(self) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "shiplog", ""

    def do_GET(self) -> None:
        page: Page = self.server.page  # type: ignore[attr-defined]
        name = self.path.partition("?")[0].removeprefix("/")
        if self.headers.get("Host") not in page.hosts:
            self._answer(HTTPStatus.FORBIDDEN, "text/plain", b"another host's name\n")
        elif name == RECORDING:
            self._recording(page.recording)
        elif name in page.files:
            kind, content = page.files[name]
            self._answer(HTTPStatus.OK, kind, content)
        else:
            self._answer(HTTPStatus.NOT_FOUND, "text/plain", b"not here\n")

    def _recording(self, path: Path) -> None:
        try:
            content = path.read_bytes()
        except OSError:
            gone = f"The recording {path.name} has gone.\n"
            self._answer(HTTPStatus.GONE, "text/plain; charset=utf-8", gone.encode())
        else:
            self._answer(HTTPStatus.OK, "application/octet-stream", content)

    def _answer(self, status: HTTPStatus, kind: str, content: bytes) -> None:
        self.send_response(status)
        for name, value in {**HEADERS, "Content-Type": kind}.items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        try:
            self.wfile.write(content)
        except ConnectionError:  # the tab was closed meanwhile
            self.close_connection = True

    def log_message(self, format: str, *args: object) -> None:
        """Not on the terminal: what a browser asks for is no news."""
