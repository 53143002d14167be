"""Rows of a text table that are not whole, headers that do not fit, and what is sound."""

import pytest
from test_conversion import PROFILE

from shiplog.commands.convert import convert
from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion.delimited import read_table
from shiplog.logs.conversion.topics import folder_to_series
from shiplog.logs.reading.read import contents
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import ingest

HEADER = "t,x,y,u,v,psi"
ROWS = [f"{i / 10},{i},0.5,1.25,0.25,5.5" for i in range(100)]


def read(tmp_path, lines, end="\n", name="t.csv"):
    text = "\n".join(lines) + end
    (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(tmp_path / name)


def changed(rows, at, change):
    return [change(row) if i in at else row for i, row in enumerate(rows)]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda row: row.replace(",0.5,", ",0.5,slow, then fast,"), "more values"),
        (lambda row: row + ",7", "more values"),
        (lambda row: row.replace(",", ",,", 1), "more values"),
        (lambda row: row[:10], "fewer values"),
        (lambda row: row.rsplit(",", 1)[0], "fewer values"),
        (lambda row: row.split(",")[0], "fewer values"),
        (lambda row: row[:8] + "\0" * 4096 + row[8:], "NUL"),
        (lambda row: row[:8] + "\0" * 8, "NUL"),
        (lambda row: row.replace(",1.25,", ',"1.25,'), "quotation mark"),
    ],
    ids=["comma in a remark", "one more", "a comma twice", "cut", "last one lost", "first one only",
         "NULs inside", "NULs and no end", "a quotation mark too many"],
)  # fmt: skip
@pytest.mark.parametrize("at", [{0}, {40, 41, 60}, {99}], ids=["first", "inside", "last"])
def test_a_row_that_is_not_whole_is_left_out_and_counted(tmp_path, change, said, at):
    found = read(tmp_path, [HEADER, *changed(ROWS, at, change)])
    assert found.frame["x"].to_list() == [i for i in range(100) if i not in at]
    assert found.frame["psi"].to_list() == [5.5] * (100 - len(at))
    (sentence,) = found.lost
    assert f"{len(at)} row{'s' * (len(at) > 1)} " in sentence and said in sentence


def test_a_damaged_row_ends_with_exit_3_and_is_told_to_ingest(tmp_path):
    lines = [HEADER, *changed(ROWS, {7, 8}, lambda row: row + ",7")]
    (tmp_path / "t.csv").write_text("\n".join(lines))
    profile = profiles.parse(PROFILE, "mine")
    done = convert([tmp_path / "t.csv"], profile, tmp_path / "out")
    (lost,) = done.lost.values()
    assert "2 rows" in lost and len(done.logs) == 1
    findings = [f for f in ingest(done.logs[0], profile).report.findings if f.kind == "dropped"]
    assert ["2 rows" in f.sentence for f in findings] == [True]
    assert contents(done.logs[0]).metadata["voyage"]["table"] == "t.csv"


def test_a_damaged_row_of_a_folder_is_a_loss(tmp_path):
    (tmp_path / "dump").mkdir()
    (tmp_path / "dump" / "gyro.csv").write_text("stamp_ns,h\n1000000000,1\n2000000000,2,3\n" * 1)
    rows = "".join(f"{i}000000000,{i}\n" for i in range(3, 20))
    with (tmp_path / "dump" / "gyro.csv").open("a") as file:
        file.write(rows)
    (topic,), reasons = folder_to_series(tmp_path / "dump", None)
    assert len(topic.time) == 18 and "1 row " in reasons[0] and "gyro.csv" in reasons[0]


SOUND = {
    "a separator at each row's end": [HEADER, *(row + "," for row in ROWS)],
    "and at the header's": [HEADER + ",", *(row + "," for row in ROWS)],
    "two of them": [HEADER, *(row + ",," for row in ROWS)],
    "rows that end early, often": [
        HEADER + ",remark", *(row + (",ok" if i % 2 else "") for i, row in enumerate(ROWS))],
    "a remark in quotation marks": [
        HEADER + ",remark", *(row + ',"slow, then ""fast"""' for row in ROWS)],
    "a remark of two lines": [
        HEADER + ",remark", *(row + (',"slow,\nfast"' if i == 40 else ",") for i, row in
                              enumerate(ROWS))],
    "blank lines": [HEADER, "", *ROWS[:50], "", *ROWS[50:], "", ""],
    "comments": ["# of a trial", HEADER, *ROWS[:50], "# helm, to port", *ROWS[50:]],
    "a last line in words": [HEADER, *ROWS, "END OF RECORD"],
    "rows of blanks": [HEADER, *ROWS, ",,,,,", ",,,,,"],
    "an inch in a remark": [HEADER + ",remark", *(row + ',pipe 5" wide' for row in ROWS)],
    "another separator in each remark": [
        HEADER + ",remark", *(row + ",zig | zag" for row in ROWS)],
    "carriage returns": [HEADER + "\r", *(row + "\r" for row in ROWS)],
    "quoted throughout": [
        ",".join(f'"{f}"' for f in row.split(",")) for row in (HEADER, *ROWS)],
}  # fmt: skip


@pytest.mark.parametrize("lines", SOUND.values(), ids=SOUND)
def test_a_sound_table_loses_nothing(tmp_path, lines):
    found = read(tmp_path, lines)
    whole = found.frame.filter(found.frame["t"].is_not_null())
    assert whole["x"].to_list() == [*range(100)] and whole["psi"].to_list() == [5.5] * 100
    assert found.lost == ()


def test_other_ends_of_line_and_letters_lose_nothing(tmp_path):
    text = "\n".join([HEADER, *ROWS])
    for name, raw in {
        "mac": text.replace("\n", "\r").encode(), "utf16": text.encode("utf-16"),
        "utf16le": text.encode("utf-16-le"), "mark": text.encode("utf-8-sig"),
        "cp1252": text.replace("psi", "psi\xb0").encode("cp1252"),
    }.items():  # fmt: skip
        (tmp_path / f"{name}.csv").write_bytes(raw)
        found = read_table(tmp_path / f"{name}.csv")
        assert found.frame.height == 100 and found.lost == (), name
        assert found.frame["x"].to_list() == [*range(100)]


def test_a_file_cut_in_its_last_number_loses_that_row(tmp_path):
    """Each row has three decimals, and the last line has one and no end."""
    rows = [f"{i / 10},{i},0.5,1.25,0.25,{5 + i / 1000:.3f}" for i in range(100)]
    found = read(tmp_path, [HEADER, *rows[:-1], rows[-1][:-2]], end="")
    assert found.frame.height == 99 and "1 row" in found.lost[0] and "cut" in found.lost[0]
    whole = read(tmp_path, [HEADER, *rows], end="")  # the same without a cut
    assert whole.frame.height == 100 and whole.lost == ()
    free = [f"{i / 10},{i},0.5,1.25,0.25,{5 + i / 8}" for i in range(95)]  # 5.125, 5.25, 5.5
    assert read(tmp_path, [HEADER, *free], end="").lost == ()


@pytest.mark.parametrize(
    "header",
    ["t,x,y,u,psi", "t,gps,u,v,psi", "t,x,y,u,v"],
)  # fmt: skip
def test_a_header_one_name_short_is_refused(tmp_path, header):
    with pytest.raises(ChannelMissing) as refused:
        read(tmp_path, [header, *ROWS])
    assert "5 names" in str(refused.value) and "6 values" in str(refused.value)


def test_a_header_with_names_to_spare_is_refused(tmp_path):
    with pytest.raises(ChannelMissing, match=r"7 names.*6 values"):
        read(tmp_path, ["t,x,y,wind (speed, dir),v,psi", *ROWS])


@pytest.mark.parametrize(
    "first",
    [
        ["2021-06-05T10:00:{:02d}.000Z", "58.{:02d}", "19.5", "5.83"],
        ["10:00:{:02d}", "58.{:02d}", "19.5", "OK"],
        ["05.06.2021 10:00:{:02d}", "58.{:02d}", "A", "5.83"],
        ["{}", "58.5", "19.5", "5.8"],
    ],
)
def test_a_table_without_a_header_keeps_its_first_row_and_asks(tmp_path, first, caplog):
    found = read(tmp_path, [",".join(first).format(i, i) for i in range(10, 40)])
    assert found.frame.columns == ["column_1", "column_2", "column_3", "column_4"]
    assert found.frame.height == 30 and "no line names the columns" in caplog.text


@pytest.mark.parametrize(
    "lines",
    [["time,1,2", "10:00:01,5,6", "10:00:02,7,8"], ["a,b", "x,y", "z,w"],
     ["time,0.5,state", "1,2,ok", "2,3,ok"]],
)  # fmt: skip
def test_a_header_of_odd_names_is_one(tmp_path, lines):
    assert read(tmp_path, lines).frame.columns == lines[0].split(",")
