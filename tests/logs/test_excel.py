"""Excel workbooks, written by another library than the one that reads them."""

import datetime
import logging

import numpy as np
import pytest

from shiplog.commands.convert import convert, draft
from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion import formats, recordings
from shiplog.logs.conversion.excel import is_excel, read_excel
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import ingest

xlsxwriter = pytest.importorskip("xlsxwriter", reason="XlsxWriter is not installed")
START = datetime.datetime(2024, 5, 3, 10, 0, 0)
ROWS = 40


@pytest.fixture
def reads():
    """What needs the extra."""
    pytest.importorskip("fastexcel", reason="the extra `excel` is not installed")


def workbook(path, **options):
    """A sheet of remarks; then one with a title, an empty line, names, units and rows."""
    book = xlsxwriter.Workbook(str(path), options)
    book.add_worksheet("Notes").write_string(0, 0, "calm, no wind")
    sheet = book.add_worksheet("Log")
    dates = book.add_format({"num_format": "yyyy-mm-dd hh:mm:ss.000"})
    clock = book.add_format({"num_format": "hh:mm:ss.000"})
    lasting = book.add_format({"num_format": "[h]:mm:ss"})
    sheet.write_string(0, 0, "Trial of 3 May")
    names = ("When", "Clock", "Lat", "Steps", "Mixed", "On", "Lasted", "Comma")
    units = {"Lat": "deg", "Steps": "rpm"}
    for place, name in enumerate(names):
        sheet.write_string(2, place, name)
        sheet.write_string(3, place, units.get(name, ""))
    for row in range(ROWS):
        at = START + datetime.timedelta(milliseconds=100 * row)
        sheet.write_datetime(row + 4, 0, at, dates)
        sheet.write_datetime(row + 4, 1, at.time(), clock)
        sheet.write_number(row + 4, 2, latitude(row))
        sheet.write_number(row + 4, 3, 100 + row)
        if row % 10:
            sheet.write_number(row + 4, 4, 0.1 * row)
        else:
            sheet.write_string(row + 4, 4, "n/a")
        sheet.write_boolean(row + 4, 5, row % 2 == 0)
        sheet.write_datetime(row + 4, 6, datetime.timedelta(hours=30, seconds=row), lasting)
        sheet.write_string(row + 4, 7, f"{row},5")
    book.close()
    return path


def latitude(row):
    """With more digits than nine after the point: a tenth of a nanodegree is 0.01 mm."""
    return 51.123456789012 + 1.1e-10 * row


@pytest.mark.parametrize("date_1904", [False, True])
def test_every_kind_of_cell_is_what_it_is(tmp_path, reads, caplog, date_1904):
    path = workbook(tmp_path / "trial.dat", default_date_format=None, date_1904=date_1904)
    assert formats.recognise(path).name == "Excel workbooks"
    with caplog.at_level(logging.INFO):
        table = read_excel(path)
    frame = table.frame
    assert frame.height == ROWS
    assert table.units == {"Lat": "deg", "Steps": "rpm"}
    wanted = np.array([(START + datetime.timedelta(milliseconds=100 * i)) for i in range(ROWS)])
    assert [str(t)[:21] for t in frame["When"].to_list()] == [str(t)[:21] for t in wanted]
    assert frame["Clock"][11] == "10:00:01.100"
    np.testing.assert_allclose(
        frame["Lat"].to_numpy(), [latitude(i) for i in range(ROWS)], rtol=0, atol=1e-14
    )
    assert frame["Steps"].to_list() == [100.0 + i for i in range(ROWS)]
    assert frame["Mixed"].null_count() == 4
    assert frame["Mixed"][11] == pytest.approx(1.1)
    assert frame["On"].to_list()[:3] == [1.0, 0.0, 1.0]
    assert frame["Lasted"][5] == 30 * 3600 + 5
    assert str(frame["Comma"][3]) in ("3.5", "3,5")


def test_the_sheet_that_the_profile_speaks_of_is_read(tmp_path, reads, caplog):
    path = tmp_path / "two.xlsx"
    book = xlsxwriter.Workbook(str(path))
    for name, columns, rows in (("large", "abc", 50), ("small", "xy", 9)):
        sheet = book.add_worksheet(name)
        sheet.write_row(0, 0, list(columns))
        for row in range(rows):
            sheet.write_row(row + 1, 0, [row + 0.5] * len(columns))
    book.close()
    with caplog.at_level(logging.INFO):
        assert read_excel(path).frame.columns == ["a", "b", "c"]
    assert "not read: small" in caplog.text
    assert read_excel(path, ["x", "y"]).frame.columns == ["x", "y"]


def test_a_workbook_becomes_a_voyage_as_its_table_does(tmp_path, reads):
    """A circle in a workbook, all its cells as text, and in a CSV."""
    time = 0.1 * np.arange(900)
    psi = 0.04 * time
    columns = {
        "t": time, "x [m]": 20.0 * np.sin(psi), "y [m]": -20.0 * np.cos(psi),
        "heading [deg]": np.degrees(psi) % 360.0, "rudder [deg]": 10.0 * np.sin(0.2 * time),
    }  # fmt: skip
    book = xlsxwriter.Workbook(str(tmp_path / "circle.xlsx"))
    sheet = book.add_worksheet()
    sheet.write_row(0, 0, list(columns))
    rows = list(zip(*columns.values(), strict=True))
    for place, row in enumerate(rows, 1):
        for column, value in enumerate(row):
            sheet.write_string(place, column, repr(float(value)))
    book.close()
    lines = [",".join(columns), *(",".join(repr(float(v)) for v in row) for row in rows)]
    (tmp_path / "csv").mkdir()
    (tmp_path / "csv" / "circle.csv").write_text("\n".join(lines))
    text = draft(tmp_path / "circle.xlsx")
    profile = profiles.parse(text, "circle.toml")
    assert [one.name for one in profile.actuators] == ["rudder"]
    tables = []
    for source, out in (("circle.xlsx", "one"), ("csv/circle.csv", "two")):
        assert convert([tmp_path / source], profile, tmp_path / out).refused == {}
        tables.append(ingest(tmp_path / out / "circle.mcap", profile).table)
    assert tables[0].equals(tables[1])


def test_a_missing_library_is_named_with_the_extra_that_brings_it(tmp_path, monkeypatch):
    def none(name):
        raise ModuleNotFoundError(name)

    path = workbook(tmp_path / "trial.xlsx")
    monkeypatch.setattr(recordings.importlib, "import_module", none)
    with pytest.raises(recordings.LibraryMissing) as refused:
        read_excel(path)
    assert "an Excel workbook" in str(refused.value)
    assert "shiplog[excel]" in str(refused.value)


def test_a_workbook_without_a_table_and_a_damaged_one_say_so(tmp_path, reads):
    book = xlsxwriter.Workbook(str(tmp_path / "notes.xlsx"))
    book.add_worksheet("Only").write_string(0, 0, "nothing")
    book.close()
    with pytest.raises(ChannelMissing, match="no sheet with a line of names"):
        read_excel(tmp_path / "notes.xlsx")
    whole = workbook(tmp_path / "whole.xlsx").read_bytes()
    (tmp_path / "cut.xlsx").write_bytes(whole[: len(whole) // 2])
    assert not is_excel(tmp_path / "cut.xlsx")  # a zip file ends with its list of files
