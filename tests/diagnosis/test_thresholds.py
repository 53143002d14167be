"""The table of thresholds in the documentation is that of the program."""

import re
from pathlib import Path

from pipelines.experiments.site import rules
from shiplog.diagnosis import thresholds

PAGE = Path(__file__).parents[2] / "docs" / "science" / "thresholds.md"
ROW = re.compile(r"^\| `([A-Z_0-9]+)` +\| ([^|]+) +\|", re.MULTILINE)


def test_the_page_is_what_the_program_decides_with():
    assert PAGE.read_text(encoding="utf-8") == rules.text(), (
        "python -m pipelines.experiments.site.rules"
    )


def test_the_page_lists_every_threshold_with_its_value():
    """A number that decides and stands on no page would be a hidden one."""
    listed = {name: float(value) for name, value in ROW.findall(PAGE.read_text(encoding="utf-8"))}
    numbers = {n: float(f"{v:.3g}") for n, v in vars(thresholds).items() if n.isupper()}
    assert listed == numbers
