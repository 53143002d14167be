"""1 Hz rows of the store's voyages by a cluster, which is this process here."""

from types import SimpleNamespace

import polars as pl
import sailing

from shiplog.commands.cluster import resample
from shiplog.training.network import cluster
from shiplog.voyages.rows import one_hertz


def test_each_table_of_a_store_has_its_own_folder(tmp_path, monkeypatch):
    """All of them are called `table.parquet`: no voyage is written over another."""
    ray = SimpleNamespace(
        remote=lambda **_: lambda task: SimpleNamespace(remote=task), get=list,
        shutdown=lambda: None,
    )  # fmt: skip
    monkeypatch.setattr(cluster, "connected", lambda address: ray)
    store = sailing.store_of(tmp_path, ["a", "b", "c"], seconds=20.0)
    profile = store.profile(["a", "b", "c"])
    paths = sorted(store.path.rglob("table.parquet"))
    assert len(paths) == 3
    found = resample(paths, profile.columns, sorted(profile.circular), tmp_path / "out", "here")
    assert len(set(found)) == 3
    for folder, name in zip(found, "abc", strict=True):
        rows = one_hertz.segments(pl.read_parquet(folder / "*.parquet"))
        assert rows.equals(store.seconds([name], profile).select(rows.columns))
