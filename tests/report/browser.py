"""A real browser without a window: chromium, driven by chromedriver's own protocol."""

from __future__ import annotations

import base64
import json
import os
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest

PATIENCE = 60.0  # s
ARGUMENTS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=1600,1000",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
    # what the browser asks for itself is not what the page asks for
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--no-first-run", "--disable-default-apps", "--disable-domain-reliability",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)  # fmt: skip


class Browser:
    """One tab."""

    def __init__(self, session):
        self._session = session

    def open(self, address):
        _call("POST", f"{self._session}/url", {"url": address})

    def run(self, script):
        return _call("POST", f"{self._session}/execute/sync", {"script": script, "args": []})

    def wait(self, script):
        """Until the script returns something."""
        end = time.monotonic() + PATIENCE
        while not (found := self.run(script)):
            assert time.monotonic() < end, f"not within {PATIENCE:g} s: {script}"
            time.sleep(0.2)
        return found

    def devtools(self, command, **parameters):
        body = {"cmd": command, "params": parameters}
        return _call("POST", f"{self._session}/goog/cdp/execute", body)

    def picture(self, path):
        path.write_bytes(base64.b64decode(_call("GET", f"{self._session}/screenshot")))

    def events(self):
        """What the developer tools report, in order; each once."""
        entries = _call("POST", f"{self._session}/se/log", {"type": "performance"})
        return [json.loads(entry["message"])["message"] for entry in entries]

    def console(self):
        entries = _call("POST", f"{self._session}/se/log", {"type": "browser"})
        return [entry["message"] for entry in entries]


@contextmanager
def chromium(folder, *arguments):
    """A browser with its network log in `folder`/net.json, complete when it is closed.

    A test is skipped where there is none.
    """
    program, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not program or not driver:
        pytest.skip("no chromium and chromedriver here")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {**os.environ, "HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
    with subprocess.Popen(
        [driver, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        env=environment,
    ) as process:  # fmt: skip
        try:
            session = _session(f"http://127.0.0.1:{port}", program, folder, arguments)
            try:
                yield Browser(session)
            finally:
                _call("DELETE", session)
        finally:
            process.terminate()


def hosts_asked(folder):
    """Origin → the hosts that its pages asked, by the browser's own network log. What the browser
    asks for itself, such as its updates, has no page as its origin and is left out."""
    log = json.loads((folder / "net.json").read_text(encoding="utf-8"))
    kinds = {number: name for name, number in log["constants"]["logEventTypes"].items()}
    found = {}
    for event in log["events"]:
        of = event.get("params", {})
        if kinds[event["type"]] == "URL_REQUEST_START_JOB" and "initiator" in of:
            host = urlsplit(of["url"]).hostname
            if of["initiator"] != "not an origin" and host is not None:
                found.setdefault(of["initiator"], set()).add(host)
    return found


def _session(driver, program, folder, arguments):
    options = {
        "binary": program,
        "args": [*ARGUMENTS, f"--log-net-log={folder / 'net.json'}", *arguments],
    }
    wanted = {
        "browserName": "chrome",
        "goog:chromeOptions": options,
        "goog:loggingPrefs": {"performance": "ALL", "browser": "ALL"},
    }
    end = time.monotonic() + PATIENCE
    while True:
        try:
            made = _call("POST", f"{driver}/session", {"capabilities": {"alwaysMatch": wanted}})
            return f"{driver}/session/{made['sessionId']}"
        except urllib.error.HTTPError:
            raise
        except OSError:  # it does not listen yet
            assert time.monotonic() < end, "chromedriver did not start"
            time.sleep(0.1)


def _call(method, address, body=None):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(address, data=data, method=method)
    with urllib.request.urlopen(request, timeout=2 * PATIENCE) as answer:
        return json.loads(answer.read())["value"]
