"""A folder with good things to spoil, and a command line judged by its sentences."""

from __future__ import annotations

import os
from pathlib import Path

import polars as pl
import sailing

from shiplog import cli
from shiplog.machine import disk_cache

PROFILE = sailing.PROFILE
TABLE = {  # what kvlcc2's [table] section reads
    "run_id": ["z1"] * 3, "t_s": [0.0, 0.1, 0.2], "x0_m": [0.0] * 3, "y0_m": [0.0] * 3,
    "psi_deg": [0.0] * 3, "u_body_mps": [1.0] * 3, "v_body_mps": [0.0] * 3, "r_degps": [0.0] * 3,
    "delta_deg": [0.0] * 3, "n_rps": [9.0] * 3,
}  # fmt: skip


class Desk:
    """A folder with a good log, a good profile and an ingested store, to spoil things in."""

    def __init__(self, folder: Path, log: Path, store: Path) -> None:
        self.folder, self.log, self.store = folder, log, store

    def path(self, name: str) -> Path:
        return self.folder / name

    def file(self, name: str, content: bytes | str = b"") -> Path:
        path = self.path(name)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def dir(self, name: str) -> Path:
        self.path(name).mkdir()
        return self.path(name)

    def profile(self, old: str = "", new: str = "") -> Path:
        assert old in PROFILE
        return self.file("p.toml", PROFILE.replace(old, new) if old else PROFILE)

    def ingest(self, *arguments) -> list:
        return ["ingest", *arguments, "--store", self.path("new")]

    def through(self, old: str, new: str) -> list:
        """Ingest the good log through a spoilt profile."""
        return self.ingest(self.log, "--profile", self.profile(old, new))

    def train(self, *arguments) -> list:
        return ["train", "--store", self.store, "--out", self.path("run"), *arguments]

    def table(self, name: str = "t.csv", **changed) -> Path:
        frame = pl.DataFrame({**TABLE, **changed})
        frame.write_csv(self.path(name)) if name.endswith("csv") else frame.write_parquet(
            self.path(name)
        )
        return self.path(name)

    def convert(self, *tables, profile: str | Path = "kvlcc2") -> list:
        return ["convert", *tables, "--profile", profile, "--out", self.path("logs")]


def judge(arguments, code, words, capsys) -> str:
    """Run a command line; its sentences."""
    found = cli.run([os.fsdecode(a) if isinstance(a, Path) else str(a) for a in arguments])
    output = capsys.readouterr()
    output = output.out + output.err
    assert found == code, output
    assert "Traceback" not in output and "unexpected fault" not in output, output
    missing = [word for word in words if word not in " ".join(output.split())]
    assert not missing, output
    assert not list((disk_cache.folder() / "faults").glob("*"))
    return output
