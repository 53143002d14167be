"""The table of thresholds in the documentation is that of the program."""

import re
from pathlib import Path

from shiplog.diagnosis import thresholds

PAGE = Path(__file__).parents[2] / "docs" / "diagnosis.md"
ROW = re.compile(r"^\| `([A-Z_0-9]+)` \| ([^|]+) \|", re.MULTILINE)


def test_the_page_lists_every_threshold_with_its_value():
    """A number that decides and stands on no page would be a hidden one."""
    section = PAGE.read_text(encoding="utf-8").split("## Thresholds")[1].split("\n## ")[0]
    listed = {name: float(value.split()[0]) for name, value in ROW.findall(section)}
    numbers = {n: round(v, 2) for n, v in vars(thresholds).items() if n.isupper()}
    assert listed == numbers
