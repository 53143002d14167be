"""The pages of causes and coefficients are what the code has."""

from pathlib import Path

import pytest

from pipelines.experiments import model_reference
from shiplog.models.causes import CATALOGUE
from shiplog.models.mmg.parameters import TABLE

DOCS = Path(__file__).parents[2] / "docs" / "reference"


@pytest.mark.parametrize("page", ["catalogue", "coefficients"])
def test_the_page_is_what_the_code_has(page):
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    assert text == getattr(model_reference, page)(), (
        "python -m pipelines.experiments.model_reference --docs docs/reference"
    )


def test_every_cause_and_every_coefficient_has_a_row():
    causes, numbers = model_reference.catalogue(), model_reference.coefficients()
    for cause in CATALOGUE:
        assert f"| `{cause.name}`" in causes and cause.story in causes
    for entries in TABLE.values():
        for entry in entries.values():
            assert f"| {entry.symbol} " in numbers and f"| {entry.meaning} " in numbers
    assert "| 4 deg " in causes and "| 0.25 of the ship's rms speed " in causes
    assert "| 2.5 deg " in causes  # an angle in degrees, not in radians
