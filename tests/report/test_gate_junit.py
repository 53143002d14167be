"""JUnit XML of a gate, read back by a public parser."""

import xml.etree.ElementTree as ET

import pytest
from gate_answers import CURRENT, evaluation, found
from junitparser import Error, Failure, JUnitXml

from shiplog.exceptions import ShiplogError
from shiplog.report.gate import judging, junit
from shiplog.report.gate.gate import Gate
from shiplog.report.gate.limits_file import parse

TEXT = """
[simulation]
loss = 1
end_position_m = 4
[band]
sway = 0.8
[diagnosis]
allowed = ["none"]
[sizes]
fouling.factor = 0.01
current.speed = 0.01
"""
HOSTILE = '<script>alert(1)</script> ]]> & "q" \' \x00\x1b[31m\n\u2028\ud800\ufffe <!ENTITY x>'


def gate(**changes):
    limits = parse(TEXT, "limits.toml")
    outcomes = judging.of_windows(limits, ("a", "b"), evaluation(range(1, 9)), "")
    outcomes += judging.of_verdict(limits, found("named", causes=[CURRENT]))
    made = {"run": "mmg", "ship": "ship", "source": "limits.toml", "voyages": ("a", "b"),
            "outcomes": tuple(outcomes), "seconds": 100, "windows": 8, "verdict": "named",
            "sentence": "It is named."}  # fmt: skip
    return Gate(**made | changes)


def suite_of(text, tmp_path):
    path = tmp_path / "gate.xml"
    path.write_text(text, encoding="utf-8")
    (suite,) = JUnitXml.fromfile(str(path))
    return suite


def test_a_public_parser_reads_failures_apart_from_errors(tmp_path):
    suite = suite_of(junit.of_gate(gate()), tmp_path)
    assert (suite.name, suite.tests, suite.failures, suite.errors) == ("shiplog gate mmg", 6, 3, 2)
    kinds = {case.name: [type(one) for one in case.result] for case in suite}
    assert kinds == {
        "L, at most 1": [Failure],
        "end position after 100 s, at most 4 m": [],
        "share of sway inside its band, at least 0.8": [Error],
        "verdict, allowed none": [Failure],
        "fouling.factor, at most 0.01": [Error],
        "current.speed, at most 0.01 m/s": [Failure],
    }
    cases = {case.name: case for case in suite}
    broken = cases["L, at most 1"].result[0]
    assert broken.type == "broken" and "4.5" in broken.message
    assert cases["fouling.factor, at most 0.01"].result[0].type == "not assessed"
    assert cases["end position after 100 s, at most 4 m"].system_out.startswith("holds")
    assert {p.name: p.value for p in suite.properties()}["voyages"] == "a, b"


def test_its_counts_are_the_text_s(tmp_path):
    done = gate()
    suite = suite_of(junit.of_gate(done), tmp_path)
    assert suite.failures + suite.errors == len(done.broken) == 5
    assert done.headline == (
        "mmg on a, b, 8 windows of 100 s: 5 of 6 limits are broken, 2 of them because they were "
        "not assessed."
    )
    assert done.json["holds"] is False and len(done.json["limits"]) == 6


def test_a_run_that_could_not_be_judged_is_an_error(tmp_path):
    suite = suite_of(junit.of_error("mmg", ShiplogError("No store.", hint="ingest.")), tmp_path)
    (case,) = suite
    (why,) = case.result
    assert isinstance(why, Error) and why.message == "No store. ingest."
    assert (suite.tests, suite.failures, suite.errors) == (1, 0, 1)


def test_names_of_strangers_are_inert(tmp_path):
    """They come back as text, whatever XML, a terminal or a browser would make of them."""
    limits = parse("[voyages.'*']\nloss = 1", "l.toml")
    name = HOSTILE.replace("\ud800", "")  # which no frame can hold
    outcomes = judging.of_windows(limits, (name,), evaluation(2.0, voyages=(name,) * 8), "")
    named = CURRENT | {"sentence": HOSTILE}
    size = parse("[diagnosis]\nallowed = ['none']\ncauses_not_allowed = ['current']", "l.toml")
    outcomes += judging.of_verdict(size, found("named", causes=[named], sentence=HOSTILE))
    done = gate(run=HOSTILE, ship=HOSTILE, source=HOSTILE, voyages=(HOSTILE,),
                outcomes=tuple(outcomes), sentence=HOSTILE)  # fmt: skip
    text = junit.of_gate(done)
    assert not set(text) & set("\x00\x1b\u2028\ud800\ufffe") and "<script" not in text
    suite = suite_of(text, tmp_path)
    assert suite.errors == 0 and suite.failures == 3
    assert {tag.tag for tag in ET.fromstring(text).iter()} == {
        "testsuites", "testsuite", "properties", "property", "testcase", "failure",
    }  # fmt: skip
    assert "<script>alert(1)</script>" in suite.name and r"\x1b[31m" in suite.name
    for line in done.lines:
        assert not set(line) & set("\n\x00\x1b\u2028")
    suite_of(junit.of_error(HOSTILE, ShiplogError(HOSTILE)), tmp_path)


@pytest.mark.parametrize("count", [1, 2])
def test_the_headline_where_all_hold(count):
    holds = [one for one in gate().outcomes if one.state == "holds"] * count
    done = gate(outcomes=tuple(holds), seconds=None)
    assert done.holds
    words = "the limit holds" if count == 1 else "all 2 limits hold"
    assert done.headline == f"mmg on a, b: {words}."
