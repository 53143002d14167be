"""Files that are not read: known by their content, with a way out that is no circle."""

from __future__ import annotations

import gzip
import io
import zipfile

import polars as pl
import pytest
import sailing

from shiplog.commands.convert import convert, draft
from shiplog.commands.prepare import check_logs, ingest_logs
from shiplog.exceptions import LogUnreadable
from shiplog.logs.conversion import packed
from shiplog.ship_profile import file as profiles
from shiplog.voyages.store.store import Store


def zipped(**files: str | bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name.replace("__", "/"), content)
    return stream.getvalue()


FILES = {  # what it is called, what is in it → what it is, and the tool that helps
    "2021.log": (b"FMT, 128, 89, FMT, BBnNZ, Type,Length\n" * 9, "DataFlash", "mavlogdump.py"),
    "trial.h5": (b"\x89HDF\r\n\x1a\n" + bytes(90), "HDF5", "h5py"),
    "trial.nc": (b"CDF\x01" + bytes(90), "NetCDF", "xarray"),
    "trial.ods": (zipped(mimetype="application/vnd.oasis"), "OpenDocument", "CSV"),
    "trial.xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(90), "Office", "CSV"),
    "track.gpx": (b'<?xml version="1.0"?>\n<gpx version="1.1"><trk/></gpx>', "GPX", "gpsbabel"),
    "track.kml": (b'\xef\xbb\xbf<?xml version="1.0"?>\n<kml>', "KML", "gpsbabel"),
    "track.fit": (b"\x0e\x10\x43\x08\0\0\0\0.FIT" + bytes(90), "FIT", "garmin_fit"),
    "run.bag.active": (b"#ROSBAG V2.0\n" + bytes(90), "not closed", "rosbag reindex"),
    "run.rosbag": (b"#ROSBAG V2.0\n" + bytes(90), "ROS 1 bag", ".bag"),
    "old.bag.log": (b"#ROSBAG V1.2\n" + bytes(90), "older", "rosbag fix"),
    "boat.db": (b"SQLite format 3\0" + bytes(90), "SQLite", "sqlite3 -header -csv"),
    "udp.pcap": (b"\xd4\xc3\xb2\xa1" + bytes(90), "network", "tshark"),
    "udp.pcapng": (b"\x0a\x0d\x0d\x0a" + bytes(90), "network", "tshark"),
    "bus.trc": (b";$FILEVERSION=1.1\n;$STARTTIME=42165.6306\n" * 9, "CAN bus", "can_logconvert"),
    "bus.blf": (b"LOGG\x90\x00\x00\x00" + bytes(90), "CAN bus", "can_logconvert"),
    "bus.asc": (b"date Tue Jun 9 2015\nbase hex  timestamps absolute\n" * 3, "CAN bus",
                "can_logconvert"),
    "trial.json": (b'{\n "a": [1, 2]\n}\n', "JSON", "json_normalize"),
    "rows.jsonl": (b'{"a": 1, "b": 2}\n{"a": 2, "b": 3}\n', "JSON", "json_normalize"),
    "trial.mf4": (b"MDF     4.10    " + bytes(90), "MDF", "asammdf"),
    "trial.npy": (b"\x93NUMPY\x01\x00" + bytes(90), "NumPy", "savetxt"),
    "raw.ubx": (b"\xb5\x62\x01\x07" + bytes(90), "UBX", "NMEA 0183"),
    "logs.7z": (b"7z\xbc\xaf\x27\x1c" + bytes(90), "7-Zip", "unpack"),
    "own.dat2": (bytes(range(256)) * 9 + bytes(900), "binary", "export"),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_every_command_says_what_a_file_is_and_the_way_out(tmp_path, name):
    content, what, tool = FILES[name]
    path = tmp_path / name
    path.write_bytes(content)
    sentences = list(convert([path], sailing.profile(), tmp_path / "out").refused.values())
    sentences += convert([path], None, tmp_path / "out").refused.values()
    with pytest.raises(LogUnreadable) as refused:
        draft(path)
    sentences.append(str(refused.value))
    for done in (check_logs([path]), ingest_logs([path], None, Store(tmp_path / "store"))):
        sentences += map(str, done.refused.values())
    assert len(sentences) == 5
    if what != "binary":  # the reader of logs looks for what is sound in what it does not know
        assert len(set(sentences)) == 1
    for said in sentences[:3]:
        assert what in said and tool in said and name in said, said
        assert "shiplog convert" not in said and "shiplog profile" not in said


def test_a_table_under_an_odd_name_is_drafted_and_converted(tmp_path):
    """Text of no known kind is a table in both commands: neither sends to the other."""
    path = tmp_path / "trial.out"
    path.write_text("time,latitude,longitude,sog,cog,heading\n" + "".join(
        f"{1_700_000_000 + i},{54 + i * 1e-5:.6f},10.0,2.0,0.0,0.0\n" for i in range(60)
    ))  # fmt: skip
    text = draft(path)
    assert "[table]" in text
    done = convert([path], profiles.parse(text, "drafted"), tmp_path / "out")
    assert [log.name for log in done.logs] == ["trial.mcap"]


TABLE = (
    "time,x,y,sog,cog,heading\n"
    + "".join(f"{1_700_000_000 + i / 10:.1f},{0.2 * i:.2f},0,2,0,0\n" for i in range(200))
)  # fmt: skip
PROFILE = """
[ship]
name = "t"
length_m = 10.0
[sensors]
position = { kind = "local", topic = "/p", fields = ["x", "y"], unit = "m" }
velocity = { kind = "sog_cog", topic = "/v", fields = ["sog", "cog"], units = ["m/s", "deg"] }
heading = { topic = "/h", field = "heading", unit = "deg" }
[table]
time = "time"
x = "x0"
y = "y0"
sog = "sog"
cog = { channel = "cog", unit = "deg" }
heading = { channel = "heading", unit = "deg" }
"""


@pytest.fixture
def profile(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text(PROFILE)
    return str(path)


@pytest.mark.parametrize("how", ["csv", "csv.gz", "zip"])
def test_a_table_is_ingested_as_it_is(tmp_path, profile, how):
    path = tmp_path / f"trip.{how}"
    raw = TABLE.encode()
    path.write_bytes(
        {"csv": raw, "csv.gz": gzip.compress(raw), "zip": zipped(**{"trip.csv": raw})}[how]
    )
    store = Store(tmp_path / "store")
    done = ingest_logs([path], profile, store)
    (report,) = done.reports
    assert (report.name, report.rows) == ("trip", 200) and done.complete
    (entry,) = store.entries()
    assert entry.source == path.name
    changed = (tmp_path / "store" / "voyage=trip" / "voyage.json").stat().st_mtime_ns
    assert ingest_logs([path], profile, store).reports == done.reports
    assert (tmp_path / "store" / "voyage=trip" / "voyage.json").stat().st_mtime_ns == changed


def test_a_change_of_the_table_section_is_a_change(tmp_path, profile):
    path = tmp_path / "trip.csv"
    path.write_text(TABLE)
    store = Store(tmp_path / "store")
    ingest_logs([path], profile, store)
    text = PROFILE.replace('x = "x0"', 'x = { channel = "x0", sign = 2.0 }')
    (tmp_path / "p.toml").write_text(text)
    ingest_logs([path], profile, store)
    table = pl.read_parquet(tmp_path / "store" / "voyage=trip" / "table.parquet")
    assert table["x0"].max() == pytest.approx(2 * 0.2 * 199)


def test_a_table_without_a_profile_is_said_once(tmp_path):
    path = tmp_path / "trip.csv"
    path.write_text(TABLE)
    (why,) = ingest_logs([path], None, Store(tmp_path / "store")).refused.values()
    assert "is a table" in str(why) and "--profile" in why.hint


@pytest.mark.parametrize("how", ["cut", "bomb"])
def test_a_packed_file_that_is_damaged_or_a_trap_is_refused(tmp_path, how, monkeypatch):
    path = tmp_path / "trip.csv.gz"
    whole = gzip.compress(TABLE.encode() if how == "cut" else bytes(1 << 22))
    path.write_bytes(whole[: len(whole) // 2] if how == "cut" else whole)
    monkeypatch.setattr(packed, "LEAST_ROOM", 1 << 20)
    (why,) = convert([path], sailing.profile(), tmp_path / "out").refused.values()
    assert ("cannot be unpacked" if how == "cut" else "far more than a log of its size") in why


def test_names_in_a_zip_stay_in_its_folder(tmp_path):
    path = tmp_path / "logs.zip"
    path.write_bytes(zipped(**{"..__..__one.csv": TABLE, "/abs__two.csv": TABLE}))
    with packed.unpacked(path) as inside:
        assert sorted(p.name for p in inside.rglob("*.csv")) == ["one.csv", "two.csv"]
    assert not (tmp_path.parent / "one.csv").exists()


def test_what_is_alike_in_all_tables_of_a_folder_is_said_once(tmp_path):
    """As ulog2csv leaves them: times since boot in every table."""
    folder = tmp_path / "px4"
    folder.mkdir()
    for number in range(30):
        rows = "".join(f"{20_471_648 + 200_000 * i},{i}\n" for i in range(30))
        (folder / f"log_topic{number}_0.csv").write_text(f"timestamp,value\n{rows}")
    (why,) = convert([folder], None, tmp_path / "out").refused.values()
    assert why.count("are no Unix time") == 1
    assert "30 tables" in why and "log_topic0_0.csv" in why and '"timestamp" =' in why
