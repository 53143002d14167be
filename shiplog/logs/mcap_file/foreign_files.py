"""Files that shiplog does not read, told by their content: what each is, and what makes a table or
a log of it.

A sentence here never names a command of shiplog that would send its reader back. The tools are
public ones, under the names that they are installed as.
"""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from shiplog.exceptions import LogUnreadable

START_BYTES = 65_536  # that tell a file by its content
BINARY_SHARE = 0.01  # of zero bytes at the start: texts have none, but for UTF-16, which is marked
MARKS = (b"\xff\xfe", b"\xfe\xff")  # of UTF-16
BLANKS = b"\xef\xbb\xbf \t\r\n"  # before a text begins, the mark of UTF-8 among them
FOLDER = "shiplog reads the folder of these tables"
TABLE = "shiplog reads that table"
Test = Callable[[bytes, Path], bool]


@dataclass(frozen=True, slots=True)
class Kind:
    """What a file is, and the way to a log of it; {file} and {stem} stand for its names."""

    what: str
    way: str
    test: Test


def _begins(*starts: bytes) -> Test:
    return lambda start, path: start.startswith(starts)


def _holds(place: int, letters: bytes) -> Test:
    return lambda start, path: start[place : place + len(letters)] == letters


def _ends(suffix: str) -> Test:
    return lambda start, path: path.suffix.lower() == suffix


def _both(one: Test, other: Test) -> Test:
    return lambda start, path: one(start, path) and other(start, path)


def _either(*tests: Test) -> Test:
    return lambda start, path: any(test(start, path) for test in tests)


def _text(pattern: str) -> Test:
    compiled = re.compile(pattern.encode(), re.MULTILINE)
    return lambda start, path: compiled.search(start[:4096].lstrip(BLANKS)) is not None


def _zip_of(*names: str) -> Test:
    def test(start: bytes, path: Path) -> bool:
        if not start.startswith(b"PK\x03\x04"):
            return False
        try:
            with zipfile.ZipFile(path) as archive:
                return any(n.lower().startswith(names) for n in archive.namelist()[:1000])
        except (OSError, zipfile.BadZipFile):
            return False

    return test


def _json(start: bytes, path: Path) -> bool:
    line = start.lstrip(BLANKS).split(b"\n", 1)[0].strip()
    if not line.startswith((b"{", b"[")):
        return False
    try:
        json.loads(line)
    except ValueError:
        return re.match(rb'[\[{]\s*("|\{|\[|$)', line) is not None
    return True


MAVLINK_WAY = (
    "make tables of it, one a kind of message, with mavlogdump.py of the Python package pymavlink: "
    "mavlogdump.py --format csv --types GPS {file} > {stem}/GPS.csv, and so on; " + FOLDER
)
GPSBABEL_WAY = (
    "gpsbabel -i {format} -f {file} -o unicsv -F {stem}.csv makes a table of its track; " + TABLE
    + ". A ship's model needs a heading, too, which a track does not have"
)  # fmt: skip
SPREADSHEET_WAY = "save its sheet as CSV in the program that made it; " + TABLE


def _gpsbabel(name: str) -> str:
    return GPSBABEL_WAY.replace("{format}", name)


KINDS = (
    Kind("an ArduPilot DataFlash log as text", MAVLINK_WAY, _text(r"^FMT, ?128, ?89, ?FMT")),
    Kind("an HDF5 file", "write its series as a table, in Python with h5py; " + TABLE,
         _begins(b"\x89HDF\r\n\x1a\n")),
    Kind("a NetCDF file", "write its variables as a table, in Python with xarray: "
         "xarray.open_dataset(...).to_dataframe().to_csv(...); " + TABLE,
         _begins(b"CDF\x01", b"CDF\x02", b"CDF\x05")),
    Kind("an Office document of the old kind", SPREADSHEET_WAY,
         _begins(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")),
    Kind("an OpenDocument file", SPREADSHEET_WAY, _zip_of("mimetype")),
    Kind("an Office document", SPREADSHEET_WAY, _zip_of("[content_types].xml")),
    Kind("a GPX track", _gpsbabel("gpx"), _text(r"<gpx\b")),
    Kind("a KML file", _gpsbabel("kml"), _text(r"<kml\b")),
    Kind("a Garmin FIT file", _gpsbabel("garmin_fit"), _holds(8, b".FIT")),
    Kind("a ROS 1 bag that was not closed", "copy it, and mend the copy: rosbag reindex {file}; "
         "call it {stem}.bag then", _both(_begins(b"#ROSBAG V2.0"), _ends(".active"))),
    Kind("a ROS 1 bag under another name", "let its name end with .bag",
         _begins(b"#ROSBAG V2.0")),
    Kind("a ROS bag older than version 2.0",
         "bring it up to date: rosbag fix {file} {stem}_fixed.bag",
         _begins(b"#ROSBAG V1", b"#ROSRECORD")),
    Kind("an SQLite database", "if ROS 2 recorded it, let its name end with .db3; else export its "
         "tables: sqlite3 -header -csv {file} 'SELECT * FROM NAME' > NAME.csv; " + TABLE,
         _begins(b"SQLite format 3\0")),
    Kind("a capture of a network", "export what is in it with tshark: its fields as a table "
         "(tshark -r {file} -T fields -E header=y -E separator=, -e frame.time_epoch -e ...), or "
         "its NMEA 0183 sentences as a text, one a line; shiplog reads both",
         _begins(b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1",
                 b"\xa1\xb2\x3c\x4d", b"\x0a\x0d\x0d\x0a")),
    Kind("a trace of a CAN bus", "make a candump log of it with can_logconvert of the Python "
         "package python-can: can_logconvert {file} {stem}.log; shiplog reads that where the bus "
         "is NMEA 2000", _either(_begins(b"LOGG"), _text(r"\A;\$FILEVERSION="),
                                 _text(r"\Adate .*\s+base (hex|dec)"))),
    Kind("a Signal K log", "let the server write NMEA 0183, with its plugin "
         "signalk-to-nmea0183, and log that; or make a table of it, one row a time and one column "
         "a path; " + TABLE, _both(_json, _text(r'"updates"'))),
    Kind("an MDF measurement file", "asammdf of Python exports it: MDF(...).export('csv'); "
         + FOLDER, _begins(b"MDF     ", b"UnFinMF ")),
    Kind("a Rerun recording", "give the log that it was made of", _begins(b"RRF")),
    Kind("an Arrow file", "write it as Parquet, in Python: "
         "polars.read_ipc(...).write_parquet(...); " + TABLE, _begins(b"ARROW1")),
    Kind("a NumPy array", "write it as a table with the names of its columns: numpy.savetxt; "
         + TABLE, _begins(b"\x93NUMPY")),
    Kind("raw u-blox data (UBX)", "let the receiver send NMEA 0183 sentences, too, and log those",
         _begins(b"\xb5\x62")),
    Kind("raw NovAtel data", "let the receiver send NMEA 0183 sentences, too, and log those",
         _begins(b"\xaa\x44\x12", b"\xaa\x44\x13")),
    Kind("a 7-Zip or RAR archive", "unpack it, and give what is in it",
         _begins(b"7z\xbc\xaf\x27\x1c", b"Rar!")),
    Kind("a tar archive", "unpack it, tar xf {file}, and give what is in it",
         _holds(257, b"ustar")),
    Kind("a PDF", "give the numbers that it was made of", _begins(b"%PDF-")),
    Kind("XML", "make a table of it; " + TABLE, _text(r"\A<\?xml\b|\A<\w+[ >]")),
    Kind("JSON", "make a table of it with one column a value, in Python: "
         "pandas.json_normalize(...).to_csv(...); " + TABLE, _json),
)  # fmt: skip


def kind_of(path: Path) -> Kind | None:
    """What a file is, if it is of a kind that is known and not read."""
    if not path.is_file():
        return None
    with path.open("rb") as stream:
        start = stream.read(START_BYTES)
    return next((kind for kind in KINDS if start and kind.test(start, path)), None)


def is_foreign(path: Path) -> bool:
    """Whether a file is of a kind that is known and not read, or of none."""
    parquet = path.suffix.lower() == ".parquet"
    return kind_of(path) is not None or (is_binary(path) and not parquet)


def is_binary(path: Path) -> bool:
    """Whether a file is no text."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        start = stream.read(START_BYTES)
    return not start.startswith(MARKS) and start.count(0) > BINARY_SHARE * len(start)


def refusal(path: Path, name: str | None = None) -> LogUnreadable | None:
    """Why a file is not read and what can be done, where it is of a known kind; `name` where it
    has another one than its path."""
    kind = kind_of(path)
    if kind is None:
        return None
    name = name or path.name
    stem = name.removesuffix(".active").rsplit(".", 1)[0] or name
    way = kind.way.replace("{file}", name).replace("{stem}", stem)
    return LogUnreadable(f"{name} is {kind.what}, which shiplog does not read.", hint=f"{way}.")


def refuse(path: Path, name: str | None = None) -> None:
    """Raises LogUnreadable for a file of a kind that is known and not read."""
    if (error := refusal(path, name)) is not None:
        raise error


def refuse_binary(path: Path, name: str) -> None:
    """Raises LogUnreadable for what is no text, and of no kind that is known."""
    if is_binary(path):
        raise LogUnreadable(
            f"{name} is binary, and of no kind that shiplog knows.",
            hint="shiplog reads MCAP logs, ROS bags, recorders' files (ArduPilot, MAVLink, NMEA "
            "2000, PX4), NMEA 0183 text, and CSV or Parquet tables: export it as one of them with "
            "the program that recorded it.",
        )
