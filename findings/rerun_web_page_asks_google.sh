#!/usr/bin/env bash
# rerun-sdk 0.41.0: the viewer's page that `rerun --serve-web --bind 127.0.0.1` serves from this machine
# takes its font from Google: a stylesheet of fonts.googleapis.com, and a connection to fonts.gstatic.com
# opened ahead. A browser that opens the page asks them (its network log has the first), so they learn
# when somebody looks at a recording. With analytics disabled (`rerun analytics disable`) the page is the
# same, byte for byte, and no Content-Security-Policy keeps it to its own server.
#
# Seen: "preconnect fonts.googleapis.com, preconnect fonts.gstatic.com, stylesheet fonts.googleapis.com;
# the same page with analytics disabled: True; Content-Security-Policy: None".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'rerun-sdk==0.41.0'
cd "$work"
export HOME="$work" XDG_CONFIG_HOME="$work/config" XDG_DATA_HOME="$work/data"
"$work/venv/bin/python" - <<'P'
import re
import socket
import subprocess
import time
import urllib.request
from urllib.parse import urlsplit

RERUN = "venv/bin/rerun"


def free() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def page() -> tuple[str, str | None]:
    """The HTML of the viewer's page, and its policy."""
    port = free()
    server = subprocess.Popen(
        [RERUN, "--serve-web", "--web-viewer-port", str(port), "--port", str(free()),
         "--bind", "127.0.0.1"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )
    try:
        for _ in range(300):
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/") as answer:
                    return answer.read().decode(), answer.headers["Content-Security-Policy"]
            except OSError:
                time.sleep(0.1)
        raise SystemExit("the server did not answer")
    finally:
        server.terminate()
        server.wait()


html, policy = page()
links = re.findall(r"<link\b[^>]*>", html)  # what a browser loads without any script
asked = sorted(
    f"{re.search('rel=.([a-z]+)', link)[1]} {urlsplit(address[1]).hostname}"
    for link in links
    if (address := re.search('href="(https?:[^"]+)"', link))
)
subprocess.run([RERUN, "analytics", "disable"], check=True, capture_output=True)
same = page()[0] == html
print(
    f"{', '.join(asked)}; the same page with analytics disabled: {same}; "
    f"Content-Security-Policy: {policy}"
)
google = ["preconnect fonts.googleapis.com", "preconnect fonts.gstatic.com",
          "stylesheet fonts.googleapis.com"]
assert (asked, same, policy) == (google, True, None), "this has changed"
P
