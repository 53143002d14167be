"""What shiplog keeps to be faster the next time: never more than its limit, oldest gone first."""

import os

import pytest

from shiplog.machine import disk_cache


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """Three files of 100 bytes, one hour apart."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    paths = [tmp_path / "shiplog" / name / "one.bin" for name in ("jax", "traced", "settled")]
    for hour, path in enumerate(paths):
        path.parent.mkdir(parents=True)
        path.write_bytes(bytes(100))
        os.utime(path, (3600.0 * hour, 3600.0 * hour))
    return paths


def test_the_oldest_go_first_until_the_limit_holds(kept):
    assert sum(n for _, n, _ in disk_cache.files()) == 300
    assert disk_cache.trim(250) == 100
    assert [path.exists() for path in kept] == [False, True, True]
    assert disk_cache.trim(250) == 0


def test_all_of_it_can_be_removed(kept):
    assert disk_cache.trim(0) == 300
    assert disk_cache.files() == []


def test_a_file_that_another_process_removed_is_passed_over(kept, monkeypatch):
    found = disk_cache.files()
    monkeypatch.setattr(disk_cache, "files", lambda: found)
    kept[0].unlink()
    assert disk_cache.trim(150) == 200  # the two that are there
