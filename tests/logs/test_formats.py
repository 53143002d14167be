"""Each format of logs is known by its name where it is chosen, and takes what is its own."""

from pathlib import Path
from typing import get_type_hints

import pytest

from shiplog.cli.convert import convert
from shiplog.logs.conversion import formats


def test_the_help_names_every_format():
    argument = get_type_hints(convert, include_extras=True)["tables"].__metadata__[0]
    for one in formats.FORMATS:
        assert one.name in argument.help or one.name == "MCAP logs", one.name


@pytest.mark.parametrize(
    ("name", "content", "wanted"),
    [
        ("a.csv", "time,lat\n0,1\n", "CSV or Parquet tables"),
        ("a.csv", "$GPRMC,120000,A,3500.0,N,13900.0,E,1.0,90.0,010120,,*1A\n", "NMEA 0183 text"),
        ("a.txt", '{"context":"vessels.self","updates":[]}\n', "Signal K logs"),
        ("a.mcap", "", "MCAP logs"),
        ("a.bag", "", "ROS bags"),
        ("a.parquet", None, "folders of one of them per topic or instrument"),
    ],
)
def test_the_first_format_that_takes_a_path_is_its_own(tmp_path, name, content, wanted):
    """Its content counts for more than its name, where there is some."""
    path = Path(tmp_path / name)
    path.mkdir() if content is None else path.write_text(content)
    assert formats.recognise(path).name == wanted
