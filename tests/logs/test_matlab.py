"""MATLAB files of every version: each row of what a reader has to do right."""

import importlib
import logging

import numpy as np
import pytest
import scipy.io
from made_matlab import level_4, level_5, write_7_3

from shiplog.commands.convert import convert, draft
from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion import formats, recordings
from shiplog.logs.conversion.matlab import is_matlab, read_matlab
from shiplog.ship_profile import file as profiles

TIME = np.arange(50) * 0.1


def written(tmp_path, content: bytes, name="trial.dat"):
    path = tmp_path / name  # the name says nothing: it is the content that counts
    path.write_bytes(content)
    return path


def test_the_draft_of_a_matrix_asks_for_each_row_and_says_which_one_counts(tmp_path):
    rows = np.stack((TIME, 2.0 * np.sin(TIME), np.cos(TIME)))
    text = draft(written(tmp_path, level_4("<", trial=rows)))
    (time,) = [line for line in text.splitlines() if line.startswith('# "trial_1"')]
    assert 'channel = "time", unit = "s"' in time
    assert "it counts by 0.1;" in time
    assert 'channel = "..." }  # CHECK: no line of the table names it' in text


@pytest.mark.parametrize("order", ["<", ">"])
def test_the_rows_of_a_matrix_of_version_4_are_columns_without_names(tmp_path, order):
    rows = np.stack((TIME, 2.0 * TIME, np.cos(TIME)))
    path = written(tmp_path, level_4(order, trial=rows))
    assert formats.recognise(path).name == "MATLAB files"
    table = read_matlab(path)
    assert table.nameless == ("trial_1", "trial_2", "trial_3")
    np.testing.assert_array_equal(table.frame.to_numpy().T, rows)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("stored", ["u1", "i2", "u2"])
def test_a_double_that_is_stored_in_few_bytes_is_a_double(tmp_path, order, stored):
    """3 - 5 of two bytes that were read as they are stored would be 254."""
    speed, wanted = np.array([3, 5, 200, 0, 7]), np.array([5, 3, 1, 9, 7])
    path = written(tmp_path, level_5(order, stored, speed=speed, wanted=wanted[:, None]))
    frame = read_matlab(path).frame
    assert (frame["speed"] - frame["wanted"]).to_list() == [-2.0, 2.0, 199.0, -9.0, 0.0]


def test_rows_and_columns_structs_cells_truths_and_what_is_empty(tmp_path):
    path = tmp_path / "trial.mat"
    inner = {"rudder": TIME[None], "on": (TIME > 1.0)[:, None], "none": np.zeros((0, 0))}
    nav = {"t": TIME[:, None], "x": TIME[None] * 2.0, "act": inner, "who": "me", "gain": 3.0}
    names = np.array([f"leg {i // 10}" for i in range(50)], object)
    scipy.io.savemat(path, {"nav": nav, "leg": names, "one": np.array([[1.0]])})
    table = read_matlab(path)
    assert table.frame.columns == ["nav.t", "nav.x", "nav.act.rudder", "nav.act.on", "leg"]
    assert table.frame["nav.act.on"].sum() == float((TIME > 1.0).sum())
    assert table.frame["leg"][11] == "leg 1"
    assert table.nameless == ()


def test_the_name_that_all_columns_share_is_left_out_and_a_struct_array_is_columns(tmp_path):
    path = tmp_path / "trial.mat"
    samples = np.array([(t, 2.0 * t) for t in TIME], dtype=[("time", "O"), ("yaw", "O")])
    scipy.io.savemat(path, {"log": samples})
    frame = read_matlab(path).frame
    assert frame.columns == ["time", "yaw"]
    np.testing.assert_allclose(frame["yaw"].to_numpy(), 2.0 * TIME)


def test_of_several_lengths_the_columns_that_the_profile_names_are_read(tmp_path, caplog):
    path = tmp_path / "trial.mat"
    slow = {"t_gps": TIME[::5], "lat": TIME[::5], "lon": TIME[::5]}
    scipy.io.savemat(path, {"t": TIME, "rudder": TIME} | slow)
    with caplog.at_level(logging.WARNING):
        assert read_matlab(path).frame.columns == ["t_gps", "lat", "lon"]
    assert "not read: rudder (50), t (50)" in caplog.text
    assert read_matlab(path, ["t", "rudder"]).frame.columns == ["t", "rudder"]


def test_version_7_3_is_turned_back_and_its_empty_arrays_are_no_numbers(tmp_path):
    pytest.importorskip("matio", reason="the extra `matlab` is not installed")
    path = tmp_path / "trial.mat"
    write_7_3(
        path, t=TIME[:, None], x=TIME[None], pair=np.stack((TIME, -TIME)), none=np.zeros((0, 0)),
        act={"rudder": 3.0 * TIME[:, None], "on": TIME[:, None] > 1.0},
    )  # fmt: skip
    with pytest.raises(NotImplementedError):
        scipy.io.loadmat(path)
    table = read_matlab(path)
    assert set(table.frame.columns) == {"t", "x", "pair_1", "pair_2", "act.rudder", "act.on"}
    assert set(table.nameless) == {"pair_1", "pair_2"}
    np.testing.assert_allclose(table.frame["pair_2"].to_numpy(), -TIME)
    np.testing.assert_allclose(table.frame["act.rudder"].to_numpy(), 3.0 * TIME)


@pytest.mark.filterwarnings("ignore:duration_to_mat")
@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_a_timetable_has_its_times_and_a_duration_is_in_seconds(tmp_path, version):
    """mat-io both writes and reads it here: what is tested is what becomes of its answer."""
    matio = pytest.importorskip("matio", reason="the extra `matlab` is not installed")
    pandas = importlib.import_module("pandas")
    path = tmp_path / "trial.mat"
    start = np.datetime64("2024-05-01T10:00:00.000", "ns")
    times = start + (TIME * 1e9).astype("timedelta64[ns]")
    frame = pandas.DataFrame({"surge": 0.5 * TIME}, index=pandas.DatetimeIndex(times, name="Time"))
    since = (TIME * 1e9).astype("timedelta64[ns]")
    matio.save_to_mat(str(path), {"log": frame, "since": since}, version=version)
    table = read_matlab(path).frame
    assert set(table.columns) == {"log.Time", "log.surge", "since"}
    np.testing.assert_allclose(table["since"].to_numpy(), TIME, atol=1e-9)
    ticks = table["log.Time"].cast(int).to_numpy()
    np.testing.assert_allclose((ticks - ticks[0]) * 1e-9, TIME, atol=1e-6)
    assert str(table["log.Time"][0]).startswith("2024-05-01 10:00:00")


def test_a_missing_library_is_named_with_the_extra_that_brings_it(tmp_path, monkeypatch):
    def none(name):
        raise ModuleNotFoundError(name)

    path = written(tmp_path, b"MATLAB 7.3 MAT-file, Platform".ljust(600))
    monkeypatch.setattr(recordings.importlib, "import_module", none)
    with pytest.raises(recordings.LibraryMissing) as refused:
        read_matlab(path)
    assert "MATLAB 7.3" in str(refused.value)
    assert "shiplog[matlab]" in str(refused.value)


def test_what_is_no_matlab_file_is_not_taken_for_one(tmp_path):
    for content in (b"", b"\0" * 600, b"time,x\n0,1\n", b"MATLAB is fine\n" * 50, b"\x89HDF\r\n"):
        assert not is_matlab(written(tmp_path, content))
    broken = level_5("<", x=TIME)[:400]
    with pytest.raises(ChannelMissing, match=r"cannot be read|no vector"):
        read_matlab(written(tmp_path, broken))


def test_a_trial_with_a_datenum_becomes_a_log_at_its_instants(tmp_path):
    """datenum counts days from the year 0: 719529 is 1 January 1970. To 20 microseconds."""
    path = tmp_path / "trial.mat"
    start = 1_714_557_600.0
    datenum = 719_529.0 + (start + TIME) / 86_400.0
    psi = 0.3 + 0.1 * np.sin(TIME)
    scipy.io.savemat(path, {"when": datenum, "x": TIME, "y": 0.1 * TIME, "psi": psi})
    text = draft(path)
    assert 'name = "trial"' in text
    profile = profiles.parse(PROFILE, "trial.toml")
    assert convert([path], profile, tmp_path / "logs").refused == {}
    from shiplog.voyages.ingest.ingest import ingest

    found = ingest(tmp_path / "logs" / "trial.mcap", profile)
    first = found.table["time"].to_physical()[0] * 1e-9
    assert first == pytest.approx(start, abs=2e-5)


PROFILE = """
[ship]
name = "trial"
length_m = 1.1
[sensors.position]
kind = "local"
topic = "/ship/state"
fields = ["x0_m", "y0_m"]
unit = "m"
[sensors.heading]
topic = "/gyro"
field = "heading_deg"
unit = "deg"
[table]
"when" = { channel = "time", unit = "d" }
"x" = { channel = "x0", unit = "m" }
"y" = { channel = "y0", unit = "m" }
"psi" = { channel = "heading", unit = "rad" }
"""


@pytest.mark.parametrize("version", ["4", "5", "7.3"])
def test_a_folder_of_trials_is_ingested_as_the_same_voyages_in_a_table_are(tmp_path, version):
    """The matrix, vectors or struct of two circles, straight into a store; and their CSV."""
    from shiplog.commands.prepare import expand, ingest_logs
    from shiplog.voyages.store.store import Store

    if version == "7.3":
        pytest.importorskip("matio", reason="the extra `matlab` is not installed")
    profile = tmp_path / "trial.toml"
    names = ("when", "x", "y", "psi")
    text = PROFILE.replace('unit = "d"', 'unit = "s"')
    if version == "4":
        for place, name in enumerate(names, 1):
            text = text.replace(f'"{name}" =', f'"run_{place}" =')
            names = tuple(f"run_{place}" if one == name else one for one in names)
    profile.write_text(text)
    (tmp_path / "mat").mkdir()
    (tmp_path / "csv").mkdir()
    time = 0.1 * np.arange(400)
    for trial, radius in (("a", 3.0), ("b", 4.0)):
        psi = 0.3 * time / radius
        columns = (time, radius * np.sin(psi), -radius * np.cos(psi), np.angle(np.exp(1j * psi)))
        path = tmp_path / "mat" / f"{trial}.mat"
        if version == "4":
            path.write_bytes(level_4("<", run=np.stack(columns)))
        elif version == "5":
            path.write_bytes(level_5("<", **dict(zip(names, columns, strict=True))))
        else:
            write_7_3(path, run=dict(zip(names, columns, strict=True)))
        rows = [",".join(repr(float(v)) for v in row) for row in zip(*columns, strict=True)]
        (tmp_path / "csv" / f"{trial}.csv").write_text("\n".join([",".join(names), *rows]))
    stores = []
    for kind in ("mat", "csv"):
        store = Store(tmp_path / f"store_{kind}")
        paths = expand([tmp_path / kind]) if kind == "mat" else [
            tmp_path / "csv" / "a.csv", tmp_path / "csv" / "b.csv"
        ]  # fmt: skip
        done = ingest_logs(paths, str(profile), store)
        assert done.refused == {}
        stores.append([frame.collect() for frame in store.tables(["a", "b"])])
    assert all(one.equals(other) for one, other in zip(*stores, strict=True))
