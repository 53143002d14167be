"""The viewer in a browser: a page of this machine that asks no other."""

import contextlib
import http.client
import http.server
import threading

import psutil
import pytest
from browser import chromium, hosts_asked

from shiplog.report import viewer
from shiplog.report.viewer import native, web_page

FROM_ELSEWHERE = b"<!doctype html><script>fetch('http://elsewhere.invalid/')</script>"


@pytest.fixture(scope="module")
def program():
    """As Rerun's own server hands it out."""
    return native._web_program()


@pytest.fixture
def served(saved, program, monkeypatch):
    monkeypatch.setattr(native, "_web_program", lambda: program)
    with viewer.serve(saved, port=0, time_s=120.0) as page:
        yield page


def asked(address, path, host=None):
    """Status, headers and content of what is at a path of the page."""
    place = address.removeprefix("http://").removesuffix("/")
    connection = http.client.HTTPConnection(place, timeout=20)
    with contextlib.closing(connection):
        connection.request("GET", path, headers={"Host": host or place})
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()


@pytest.mark.viewer
@pytest.mark.parametrize("path", ["/", "/start.js", "/re_viewer_bg.wasm", "/recording.rrd", "/no"])
def test_every_answer_forbids_other_addresses(served, path):
    status, headers, _ = asked(served.address, path)
    rules = dict(
        rule.strip().split(" ", 1) for rule in headers["Content-Security-Policy"].split(";")
    )
    assert status == (404 if path == "/no" else 200)
    assert rules["default-src"] == "'none'"  # whatever has no rule of its own
    assert rules["connect-src"] == rules["style-src"] == "'self'"
    assert rules["script-src"] == "'self' 'wasm-unsafe-eval'"
    assert "http" not in " ".join(rules.values())


@pytest.mark.viewer
def test_the_page_names_no_other_address_and_holds_the_recording(served, saved):
    _, _, page = asked(served.address, "/")
    _, _, start = asked(served.address, "/start.js")
    assert b"//" not in page  # neither a font nor a name to look up
    assert b"http" not in start
    assert asked(served.address, "/recording.rrd?again")[2] == saved.read_bytes()


@pytest.mark.viewer
def test_a_page_elsewhere_that_calls_itself_this_machine_reads_nothing(served):
    status, _, content = asked(served.address, "/recording.rrd", host="elsewhere.invalid")
    assert (status, content) == (403, b"another host's name\n")


@pytest.mark.viewer
def test_a_recording_that_has_gone_is_said_in_a_sentence(program, compared, tmp_path, monkeypatch):
    monkeypatch.setattr(native, "_web_program", lambda: program)
    path = tmp_path / "compare.rrd"
    viewer.save(compared, path)
    with viewer.serve(path, port=0) as served:
        path.unlink()
        status, _, content = asked(served.address, "/recording.rrd")
    assert (status, content) == (410, b"The recording compare.rrd has gone.\n")


@pytest.mark.viewer
def test_it_listens_on_this_machine_only_and_leaves_no_program_behind(saved):
    me = psutil.Process()
    before = {c.laddr for c in me.net_connections("inet")}
    children = me.children(recursive=True)
    with viewer.serve(saved, port=0):
        new = [c.laddr for c in me.net_connections("inet") if c.laddr not in before]
        assert {address.ip for address in new} == {"127.0.0.1"}
        assert me.children(recursive=True) == children  # Rerun's own server has ended
    listening = (c for c in me.net_connections("inet") if c.status == psutil.CONN_LISTEN)
    assert not {c.laddr for c in listening} - before


def test_the_cursor_is_asked_for_as_rerun_asks_for_it():
    """The bytes that Rerun's own client sends for `set_time("sim_time", duration=300.0,
    play_state="paused")`, read off the wire."""
    sent = bytes.fromhex("3217120a0a0873696d5f74696d651a070880f092cbdd082801")
    assert bytes(web_page.cursor_at("sim_time", 300.0)) == sent


@pytest.mark.long
@pytest.mark.viewer
def test_a_real_browser_shows_the_recording_and_asks_no_other_host(served, tmp_path):
    """By the browser's own log; a page without a policy shows that the log would have it."""
    with _other_page() as other, chromium(tmp_path) as browser:
        browser.open(served.address)
        browser.wait("return document.documentElement.dataset.shiplog")
        browser.run("fetch('http://elsewhere.invalid/').catch(() => { window.refused = true; })")
        browser.wait("return window.refused")
        assert browser.run("return document.documentElement.dataset.shiplog") == "shown"
        state = bytes(browser.run("return Array.from(window.viewer.viewer_state())"))
        assert web_page._varint(120 * 10**9) in state  # where the cursor stands
        browser.picture(tmp_path / "page.png")
        browser.open(other)
        browser.wait("return document.readyState == 'complete'")
    hosts = hosts_asked(tmp_path)
    assert hosts[served.address.removesuffix("/")] == {"127.0.0.1"}
    assert "elsewhere.invalid" in hosts[other]
    assert (tmp_path / "page.png").stat().st_size > 50_000


@contextlib.contextmanager
def _other_page():
    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(FROM_ELSEWHERE)

        def log_message(self, *_):
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
