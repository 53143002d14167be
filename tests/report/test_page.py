"""The page of a verdict, read back: what it says, and what it must not hold."""

import json
import re
from html.parser import HTMLParser
from itertools import pairwise

import html5lib
import page_content
import pytest

from shiplog.exceptions import ShiplogError
from shiplog.machine import paths
from shiplog.models.causes import CATALOGUE
from shiplog.report.diagnosis.sections import subject
from shiplog.report.figures.bars import spoken
from shiplog.report.figures.content import Content
from shiplog.report.page import html, results
from shiplog.report.page.blocks import Number, Page, Paragraph, Section
from shiplog.report.page.diagnosis import answer, considered, page, record_next, source
from shiplog.report.page.evaluation import page as evaluation_page
from shiplog.report.page.evaluation import source as evaluation_source

VERDICTS = ("named", "none", "undecided", "unknown", "coverage", "external")


class Read(HTMLParser):
    """Elements with their attributes, and each `<data>` with its text."""

    def __init__(self):
        super().__init__()
        self.elements, self.data, self.text, self._open = [], [], [], None

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag == "data":
            self._open = float(dict(attrs)["value"])

    def handle_data(self, data):
        self.text.append(data)
        if self._open is not None:
            self.data.append((self._open, data))
            self._open = None


def read(text):
    found = Read()
    found.feed(text)
    return found


def numbers(content):
    """Every number of a JSON content."""
    if isinstance(content, dict):
        return {n for value in content.values() for n in numbers(value)}
    if isinstance(content, list):
        return {n for value in content for n in numbers(value)}
    return {float(content)} if isinstance(content, int | float) else set()


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = page_content.folder(tmp_path_factory.mktemp("page") / "diagnosis")
    return html.render(page.of_folder(folder))


def test_every_number_is_one_of_the_json_and_is_rounded_from_it(made):
    there = numbers(page_content.verdict()) | {20.0}  # seconds left out: 30 - 10
    written = read(made).data
    assert len(written) > 20
    for value, text in written:
        assert value in there, text
        shown = float(re.match(r"-?[0-9.]+", text)[0])
        shown = shown / 100.0 if "%" in text else shown
        assert shown == pytest.approx(value, rel=0.051, abs=0.0051), text


def test_the_first_screen_answers_the_five_questions(made):
    text = " ".join("".join(read(made).text).split())
    first = text[: text.index("Where it shows", text.index("The answer What"))]
    for said in (
        "Current explains 75% of the error of the simulation by mmg on 1 held-out window",
        "A steady current.", "probability 0.97", "Measure it.",
        "wind force below 140 %", "Not testable here: bank",
    ):  # fmt: skip
        assert said in first, said


@pytest.mark.parametrize("word", VERDICTS)
def test_valid_html_for_every_verdict(word, tmp_path):
    content = page_content.verdict(word)
    if word == "unknown":
        content["structure"] = {"family": "motion", "acts_on": ["sway"], "depends_on": ["surge"]}
    folder = page_content.folder(tmp_path / "d", content)
    text = html.render(page.of_folder(folder))
    html5lib.HTMLParser(strict=True).parse(text)
    ids = [a["id"] for _, a in read(text).elements if "id" in a]
    assert len(ids) == len(set(ids))


def test_nothing_comes_from_elsewhere_and_no_script_runs(made):
    for tag, attributes in read(made).elements:
        assert tag not in ("script", "iframe", "link", "img", "object", "embed", "base", "form")
        assert not any(name.startswith("on") for name in attributes), attributes
        for name in ("src", "href", "xlink:href"):
            assert attributes.get(name, "#").startswith("#"), attributes
    assert not re.search(r"url\((?!#)|@import|@font-face", made)
    assert "default-src 'none'" in made
    assert page_content.HOSTILE not in made  # a name as a stranger chose it: escaped wherever


def test_a_reader_without_eyes_or_mouse(made):
    found = read(made)
    levels = [int(tag[1]) for tag, _ in found.elements if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(b - a <= 1 for a, b in pairwise(levels))
    drawn = [a for tag, a in found.elements if a.get("role") == "img"]
    assert len(drawn) >= 10
    assert all(len(a["aria-label"]) > 20 for a in drawn)
    assert ("html", {"lang": "en"}) in found.elements
    anchors = {a["href"][1:] for tag, a in found.elements if tag == "a"}
    assert anchors <= {a.get("id") for _, a in found.elements}


def luminance(colour):
    """Of sRGB, by WCAG 2.2."""
    parts = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_contrast(made):
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    colour = dict(re.findall(r"--(\w+): (#[0-9a-f]{6})", made))
    for ink in ("ink", "soft", "link"):
        for ground in ("#ffffff", colour["ground"]):
            assert contrast(colour[ink], ground) >= 4.5, ink
    for word in re.findall(r"\.word\.\w+ \{ background: (#[0-9a-f]{6})", made):
        assert contrast("#ffffff", word) >= 4.5


def test_what_became_of_every_cause_of_the_catalogue():
    rows = {name: (state, why) for name, state, why in considered.table(page_content.verdict())}
    assert {spoken(c.label) for c in CATALOGUE if not c.special} == set(rows)
    state = {name: one[0] for name, one in rows.items()}
    assert state["current"] == considered.NAMED
    assert state["wind force"] == considered.SMALL
    assert state["payload"] == considered.EXCLUDED
    assert state["fouling"] == considered.EXCLUDED  # tested, and nothing of its size found
    assert state["rudder lag"] == considered.TRACE
    assert state["bank"] == considered.UNTESTABLE
    assert state["clock offset (gnss)"] == considered.EXCLUDED
    assert state["clock offset (wind)"] == considered.ABSENT
    assert rows["wind force"][1] == ["would show from 140 %"]


def test_a_candidate_of_an_undecided_verdict_is_not_excluded():
    half = [{"name": "wind_force", "probability": 0.5}, {"name": "payload", "probability": 0.45},
            {"name": "fouling", "probability": 0.05}]  # fmt: skip
    verdict = page_content.verdict("undecided", ranking=half)
    state = {name: state for name, state, _ in considered.table(verdict)}
    assert state["wind force"] == state["payload"] == considered.OPEN
    assert state["fouling"] == considered.EXCLUDED


def cards(verdict):
    """Question → its answer, of the first screen."""
    content = Content(verdict, page_content.pictures())
    pairs = answer.blocks(source.Source(content, {}))[0].pairs
    said = {ask: [p if isinstance(p, str) else p.text for line in lines for p in line]
            for ask, lines in pairs}  # fmt: skip
    return {ask: "".join(parts) for ask, parts in said.items()}


def test_what_to_do_speaks_of_a_test_only_where_there_is_one():
    do = "What do I do?"
    assert "test below" not in cards(page_content.verdict("undecided"))[do]
    note = "A test that separates them: a turning circle."
    assert "test below" in cards(page_content.verdict("undecided", notes=[note]))[do]


def test_no_change_below_nine_tenths_says_where_the_rest_is():
    ranking = [{"name": "none", "probability": 0.84}, {"name": "payload", "probability": 0.02}]
    how = "How sure?"
    found = cards(page_content.verdict("none", ranking=ranking))[how]
    assert "0.84" in found and answer.NOT_FAVOURED in found and "Payload" not in found
    assert answer.NONE_STATED in cards(page_content.verdict("undecided", ranking=ranking))[how]


def test_what_acts_beside_a_named_cause_is_said_on_the_first_screen():
    ranking = [{"name": "unknown:heading", "probability": 1.0},
               {"name": "current", "probability": 0.97}]  # fmt: skip
    found = cards(page_content.verdict(ranking=ranking))
    assert "no cause of the catalogue explains (heading)" in found["What is wrong?"]
    assert "Expect the rest" in found["What do I do?"]
    assert "Beside" not in cards(page_content.verdict())["What is wrong?"]


def test_a_channel_that_was_not_testable_is_not_the_whole_cause():
    gnss = [{"name": "heading_offset", "reason": "gnss: the velocity is recorded over ground"}]
    missed = cards(page_content.verdict(unavailable=gnss))["What would have been missed?"]
    assert "Not testable here: heading offset (gnss)." in missed


def test_what_was_not_assessed_is_counted_among_what_would_have_been_missed():
    nothing = page_content.verdict("coverage", limits=[], ranking=[], rejected=[], traces=[])
    missed = cards(nothing)["What would have been missed?"]
    every = sum(not c.special for c in CATALOGUE)
    assert f"Not assessed: {every - 1} of {every} causes." in missed  # bank is not testable


def test_a_verdict_that_is_no_answer_asks_for_more():
    for word, says in (("none", "Nothing is needed"), ("coverage", "No manoeuvre is known")):
        made = source.Source(
            Content(page_content.verdict(word, intervals=[], limits=[]), page_content.pictures()),
            {},
        )
        assert record_next.blocks(made)[0].line[0].startswith(says)


def judged(lost=0, lengths=2.0, degrees=10.0):
    ends = {"median_end_position_lengths": lengths, "median_end_heading_deg": degrees}
    return {"windows": 5, "judgement": {"diverged": lost} | ends}


def test_windows_that_diverged_are_no_part_of_the_median():
    content = Content(page_content.verdict(), page_content.pictures())
    about = page_content.verdict()["subject"]
    run = evaluation_source.Source(content, {"mmg": judged(2)}, about)
    claim = evaluation_page._claim("mmg", judged(2), run)
    assert "mmg is 2 ship lengths and 10 deg off, in the median of 3 of 5 windows" in claim
    assert claim.endswith("; 2 diverged.")
    assert evaluation_page._diverged(judged(2)) == "2 of 5 windows diverged, so there is no mean."
    assert evaluation_page._diverged(judged(5)) == "Every window diverged."


def test_of_several_runs_the_claim_is_about_each():
    content = Content(page_content.verdict(), page_content.pictures())
    answers = {"mmg": judged(), "network": judged(1, 7.0), "lost": judged(5, None, None)}
    run = evaluation_source.Source(content, answers, page_content.verdict()["subject"])
    claim = evaluation_page._claim("mmg", answers["mmg"], run)
    assert "mmg 2 ship lengths and 10 deg off; network 7 ship lengths" in claim
    assert claim.endswith("off, 1 diverged; lost diverges.")


def test_a_share_is_said_once_where_it_is_the_same():
    assert evaluation_page._span([0.921, 0.924]) == "92%"
    assert evaluation_page._span([0.97, 1.0]) == "97% to 100%"


@pytest.mark.parametrize("name", ["x.pdf", "x.PNG", "x.md"])
def test_a_page_is_not_written_as_what_it_is_not(tmp_path, name):
    with pytest.raises(ShiplogError, match="the page is HTML"):
        paths.check_page(tmp_path / name, "--out")
    for given in ("x", "x.html"):
        assert paths.check_page(tmp_path / given, "--out") == tmp_path / "x.html"


def test_a_recorder_without_a_date_has_none():
    assert subject.begin("1970-01-01T00:45:00+00:00") == "without a date"
    assert subject.begin("2026-04-14T02:00:00+00:00") == "2026-04-14 02:00"


def test_a_finding_opens_the_recording_at_its_moment(tmp_path):
    folder = page_content.folder(tmp_path / "d")
    text = "".join(read(html.render(page.of_folder(folder))).text)
    quoted = page_content.HOSTILE.replace("'", "'\\''")
    assert f"shiplog compare runs/mmg --store store --at '{quoted}:10'" in text


def test_a_page_of_ten_voyages_is_below_one_megabyte(tmp_path):
    voyages = tuple(f"voyage_{i}" for i in range(10))
    folder = page_content.folder(
        tmp_path / "d", page_content.verdict(voyages=voyages), page_content.pictures(voyages, 7)
    )
    assert len(html.render(page.of_folder(folder)).encode()) < 1e6


def _without(folder, *keys):
    """The verdict of this folder without one of its keys."""
    content = json.loads((folder / "verdict.json").read_text())
    of = content
    for key in keys[:-1]:
        of = of[key]
    del of[keys[-1]]
    (folder / "verdict.json").write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("break_it", "says"),
    [
        (lambda d: _without(d, "limits"), "does not have limits"),
        (lambda d: _without(d, "subject", "voyages"), "does not have subject.voyages"),
        (lambda d: (d / "verdict.json").unlink(), "is no result of shiplog"),
        (lambda d: (d / "verdict.json").write_text("{"), "cannot be read"),
        (lambda d: (d / "verdict.json").write_text(json.dumps({"contract": 0})), "contract 1"),
        (lambda d: (d / "pictures" / "tracks.parquet").unlink(), "pictures' data"),
        (lambda d: (d / "pictures" / "tracks.parquet").write_bytes(b"PAR1"), "pictures' data"),
        (lambda d: (d / "pictures" / "facts.json").write_text("[]"), "pictures' data"),
    ],
)
def test_a_spoilt_folder_is_one_sentence_and_never_half_a_page(break_it, says, tmp_path):
    folder = page_content.folder(tmp_path / "d")
    break_it(folder)
    with pytest.raises(ShiplogError, match=says):
        results.page_of(folder)
    assert not (folder / "report.html").exists()


def test_a_folder_of_an_earlier_version(tmp_path):
    content = page_content.verdict()
    del content["subject"]
    with pytest.raises(ShiplogError, match="earlier shiplog"):
        source.read(page_content.folder(tmp_path / "d", content))


def test_text_is_escaped_and_code_is_code():
    shown = Page("t", "<b>k</b>", "w", "good", "c <i>", [
        Section("s", "S <u>", [Paragraph(["a `b<c>` d ", Number(0.5, "<50%>")]),
                               Paragraph(["an odd ` stays"])]),
    ])  # fmt: skip
    text = html.render(shown)
    assert "<b>k" not in text and "<i>" not in text and "<u>" not in text and "<c>" not in text
    assert '<code>b&lt;c&gt;</code> d <data value="0.5">&lt;50%&gt;</data>' in text
    assert "an odd ` stays" in text


def test_limits_of_the_user_stand_next_to_the_prediction(tmp_path):
    folder = page_content.folder(tmp_path / "d")
    assert "No limit was declared" in html.render(page.of_folder(folder))
    one = {"name": "speed of current", "expected": "at most 0.03 m/s", "found": "0.11 m/s",
           "reason": "", "outcome": "broken"}  # fmt: skip
    other = {"name": "end position", "expected": "at most 4 m", "found": "",
             "reason": "no window was simulated", "outcome": "not assessed"}  # fmt: skip
    gate = {"limits": [one, other], "limits_file": "<limits>.toml", "sentence": "2 of 2 broken."}
    (folder / "gate.json").write_text(json.dumps(gate), encoding="utf-8")
    text = html.render(page.of_folder(folder))
    said = "".join(read(text).text)
    assert "Against <limits>.toml: 2 of 2 broken." in said and "<limits>" not in text
    for word in ("at most 0.03 m/s", "broken", "no window was simulated", "not assessed"):
        assert word in said


def test_the_command_of_a_moment_is_one_for_any_shell(tmp_path):
    """Folders with blanks, and a voyage with a quotation mark, as the shell takes them apart."""
    import shlex

    folder = page_content.folder(
        tmp_path / "d", page_content.verdict(voyages=("it's",)), page_content.pictures(("it's",)),
        run_path="my runs/mmg", store_path="a store",
    )  # fmt: skip
    text = "".join(read(html.render(page.of_folder(folder))).text)
    line = next(one for one in text.splitlines() if one.startswith("shiplog compare"))
    assert shlex.split(line) == [
        "shiplog", "compare", "my runs/mmg", "--store", "a store", "--at", "it's:0",
    ]  # fmt: skip
