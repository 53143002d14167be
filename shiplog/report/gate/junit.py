"""A gate's result as JUnit XML, which CI systems read: a test case a limit.

A broken limit is a `failure`. One that was not assessed, and a run that could not be judged at all,
is an `error`: the gate does not pass then either, but nothing is known of the model.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

from shiplog.exceptions import ShiplogError
from shiplog.report.evaluation.text_table import one_line
from shiplog.report.gate.gate import Gate

# Every character but those that XML 1.0 (5th edition, production 2) allows.
ILLEGAL = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def of_gate(done: Gate) -> str:
    """The whole document."""
    suite = _suite(done.run)
    facts = {"run": done.run, "ship": done.ship, "voyages": ", ".join(done.voyages),
             "limits": done.source, "verdict": done.verdict, "sentence": done.sentence}  # fmt: skip
    properties = ET.SubElement(suite, "properties")
    for name, value in facts.items():
        if value:
            ET.SubElement(properties, "property", name=name, value=_legal(value))
    counts = {"failure": 0, "error": 0}
    for one in done.outcomes:
        name = f"{one.name}, {one.expected}"
        case = ET.SubElement(
            suite, "testcase", classname=_legal(f"shiplog.gate.{one.section}"), name=_legal(name)
        )
        if one.state == "holds":
            ET.SubElement(case, "system-out").text = _legal(one.line)
            continue
        tag = "failure" if one.state == "broken" else "error"
        counts[tag] += 1
        _bad(case, tag, one.state, one.line)
    return _document(suite, len(done.outcomes), counts["failure"], counts["error"])


def of_error(run: str, error: ShiplogError) -> str:
    """Where the run could not be judged: one test case that could not be run."""
    suite = _suite(run)
    case = ET.SubElement(suite, "testcase", classname="shiplog.gate", name="the run can be judged")
    _bad(case, "error", "not judged", str(error))
    return _document(suite, 1, 0, 1)


def _suite(run: str) -> ET.Element:
    return ET.Element("testsuite", name=_legal(f"shiplog gate {run}"))


def _bad(case: ET.Element, tag: str, kind: str, text: str) -> None:
    message = " ".join(text.split())
    ET.SubElement(case, tag, type=kind, message=_legal(message)).text = _legal(message)


def _document(suite: ET.Element, tests: int, failures: int, errors: int) -> str:
    counts = {"tests": str(tests), "failures": str(failures), "errors": str(errors)}
    suite.attrib.update(counts, skipped="0")
    root = ET.Element("testsuites", {"name": "shiplog gate", **counts})
    root.append(suite)
    ET.indent(root, space=" ")
    text = ET.tostring(root, encoding="unicode", short_empty_elements=True)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _legal(text: str) -> str:
    """With control characters, and whatever XML cannot hold, as escapes."""
    return ILLEGAL.sub(lambda found: found[0].encode("unicode_escape").decode(), one_line(text))
