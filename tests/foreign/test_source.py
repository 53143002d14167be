"""A run's simulator is known by its SHA-256, and is given by hand."""

import hashlib

import pytest

from shiplog.exceptions import UsageError
from shiplog.foreign import source
from shiplog.foreign.source import SimulatorError


def test_a_file_is_read_with_its_hash(tmp_path):
    path = tmp_path / "given.py"
    path.write_bytes(b"def f(state, inputs, t): ...")
    expected = hashlib.sha256(path.read_bytes()).hexdigest()
    found = source.read(f"{path}:other")
    assert (found.name, found.kind, found.function) == ("given.py", "callable", "other")
    assert found.sha256 == expected and source.read(str(path)).function == ""


def test_what_names_a_simulator():
    assert [source.recognised(one) for one in ("a.py", "A.FMU", "a.py:f", "logs:/sim/m/state")] == (
        [True] * 4
    )
    assert not any(source.recognised(one) for one in ("mmg", "feedforward", "mmg.toml"))
    with pytest.raises(UsageError, match="no simulator's file"):
        source.read("mmg.toml")
    with pytest.raises(SimulatorError, match="cannot be read"):
        source.read("nowhere.py")


def test_another_hash_is_refused_and_none_is_asked_for(tmp_path):
    path = tmp_path / "given.py"
    path.write_text("1")
    one = source.read(str(path))
    assert source.matching([one], "run", "given.py", one.sha256) is one
    with pytest.raises(SimulatorError, match="not the simulator that run was made of"):
        source.matching([one], "run", "given.py", "0" * 64)
    assert source.matching([], "run", "given.py", one.sha256) is None
    assert "--simulator" in source.absent("run", "given.py", one.sha256).hint
