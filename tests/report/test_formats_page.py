"""The pages of formats name every word that a machine may read."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from pipelines.experiments import verdict_reference
from shiplog.logs.conversion.write import LOG_CONTRACT, SCHEMAS
from shiplog.logs.health.health_report import FINDING_KINDS, Instrument, VoyageReport
from shiplog.models.causes.user import ANSWERS
from shiplog.nomenclature.channels import UNUSABLE, Quality
from shiplog.nomenclature.contract import CONTRACT
from shiplog.report.diagnosis.sections.structure import DEPENDS
from shiplog.report.diagnosis.verdict import Verdict

PAGES = Path(__file__).parents[2] / "docs" / "reference"
PAGE = "\n".join(
    (PAGES / f"{name}.md").read_text(encoding="utf-8")
    for name in ("formats", "streams", "findings", "answers")
)
ANSWERS_PAGE = (PAGES / "answers.md").read_text(encoding="utf-8")
WORDS = set(re.findall(r"`([^`]+)`", PAGE))
ROWS = {
    cells[0]: cells[1:]
    for line in PAGE.splitlines()
    if line.startswith("|")
    for cells in [[cell.strip().strip("`") for cell in line.strip("|").split("|")]]
}


@pytest.mark.parametrize("mark", [mark for mark in Quality if mark])
def test_every_mark_of_a_row_has_its_bit(mark):
    bit, unusable, _ = ROWS[mark.name]
    assert int(bit) == mark.value
    assert unusable == ("yes" if mark & UNUSABLE else "no")


def test_every_message_has_its_fields():
    by_message = {cells[1].strip("`"): cells[2] for cells in map(list, _rows_of("## Logs"))}
    assert by_message.keys() == SCHEMAS.keys()
    for message, keys in SCHEMAS.items():
        named = re.findall(r"`([a-z0-9_]+)`", by_message[message])
        assert [name for name in named if name != "position_covariance"] == list(keys)


def test_every_kind_of_finding_and_word_of_a_verdict_is_there():
    assert set(FINDING_KINDS) <= WORDS
    assert {*ANSWERS, "named"} - {"side_thrust"} <= WORDS  # a cause, and in the catalogue
    assert {*DEPENDS, "controls"} <= WORDS


def test_every_key_of_a_report_and_a_verdict_is_there():
    report = VoyageReport("v", 1, 0, 1, 0.1, instruments=(Instrument("gyro", 10.0, 0.0, "deg"),))
    content = report.as_json()
    assert {*content, *content["messages"], *content["instruments"][0]} <= WORDS
    empty = Verdict("none", "", "run", True, "").as_json()
    assert {*empty, *empty["base"], "structure", "gain"} - {"contract"} <= WORDS


def test_the_part_on_the_verdict_is_what_the_code_writes():
    assert verdict_reference.page(ANSWERS_PAGE) == ANSWERS_PAGE, (
        "python -m pipelines.experiments.verdict_reference --markdown docs/reference/answers.md"
    )
    empty = Verdict("none", "", "run", True, "").as_json()
    written = {*empty, "structure", "gain", "subject", "recording"} - {"contract"}
    assert written == verdict_reference.KEYS.keys()


def test_what_a_docstring_says_of_a_field_is_said_of_one_that_there_is():
    for of in verdict_reference.KEYS.values():
        if isinstance(of, type):
            named = verdict_reference.documented(of)[1]
            assert named.keys() <= {one.name for one in fields(of)}, of


def test_the_page_is_of_this_contract():
    assert f"units; it is {CONTRACT}." in " ".join(PAGE.split()) and str(CONTRACT) == LOG_CONTRACT


def _rows_of(heading):
    section = PAGE.partition(f"\n{heading}\n")[2].partition("\n## ")[0]
    rows = [line for line in section.splitlines() if line.startswith("| `")]
    return ([cell.strip() for cell in line.strip("|").split("|")] for line in rows)
