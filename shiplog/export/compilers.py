"""The C compilers that are here: this machine's, and ziglang's for the other systems."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from shiplog.exceptions import ShiplogError

OPTIONS = ("-std=c99", "-O2", "-g0", "-fPIC", "-ffp-contract=off", "-fvisibility=hidden")
PATIENCE = 300.0  # s: a network of a thousand units compiles in ten
FIRST_PATIENCE = 1200.0  # s: the first time ziglang compiles a system's C library as well
LAST = 400  # letters of a compiler's complaint


@dataclass(frozen=True)
class System:
    """A kind of machine that binaries are for.

    fmi2, fmi3   names of its folder in an FMU
    triple       ziglang's word
    ending       of its shared libraries
    """

    fmi2: str
    fmi3: str
    triple: str
    ending: str


SYSTEMS = (
    System("linux64", "x86_64-linux", "x86_64-linux-gnu.2.17", ".so"),
    System("win64", "x86_64-windows", "x86_64-windows-gnu", ".dll"),
    System("darwin64", "x86_64-darwin", "x86_64-macos", ".dylib"),
    System("", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
    System("", "aarch64-darwin", "aarch64-macos", ".dylib"),
)


def here() -> str:
    """FMI 3's word for this machine."""
    kind = {"AMD64": "x86_64", "amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine(), platform.machine()
    )
    system = {"Linux": "linux", "Windows": "windows", "Darwin": "darwin"}.get(
        platform.system(), platform.system().lower()
    )
    return f"{kind}-{system}"


def own() -> str | None:
    """This machine's own compiler."""
    return next((found for name in ("gcc", "clang", "cc") if (found := shutil.which(name))), None)


def zig() -> list[str] | None:
    """The command of ziglang's compiler, where it is installed."""
    if importlib.util.find_spec("ziglang") is None:
        return None
    return [sys.executable, "-m", "ziglang", "cc"]


def for_system(system: System) -> list[str] | None:
    """The command that compiles for a system; None where nothing here does."""
    if system.fmi3 == here() and (compiler := own()) is not None:
        return [compiler]
    cross = zig()
    return None if cross is None else [*cross, "-target", system.triple]


def shared(
    command: Sequence[str], source: Path, out: Path, system: System, more: Sequence[str] = ()
) -> None:
    """A shared library of one C file, without a path of this machine in it; `more` are libraries
    that it needs. Raises ShiplogError."""
    out.parent.mkdir(parents=True, exist_ok=True)
    strip = [] if "darwin" in system.fmi3 else ["-s"]
    libraries = list(more) if "windows" in system.fmi3 else ["-lm", *more]
    plain = [o for o in OPTIONS if o != "-fPIC" or "windows" not in system.fmi3]
    words = [*command, *plain, "-shared", *strip, "-o", out.name, source.name, *libraries]
    run(words, source.parent, patience=PATIENCE if len(command) == 1 else FIRST_PATIENCE)
    (source.parent / out.name).replace(out)
    for leaving in (".lib", ".pdb"):  # of Windows
        (source.parent / out.with_suffix(leaving).name).unlink(missing_ok=True)


def run(
    command: Sequence[str], folder: Path, given: bytes | None = None, patience: float = PATIENCE
) -> bytes:
    """What a program of this machine answers. Raises ShiplogError where it fails."""
    try:
        done = subprocess.run(
            command, cwd=folder, input=given, capture_output=True, timeout=patience, check=False,
            env={**os.environ, "LC_ALL": "C"},
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ShiplogError(
            f"{Path(command[0]).name} did not end well: {error}.",
            hint="export again when this machine is less busy.",
        ) from error
    if done.returncode:
        said = done.stderr.decode(errors="replace")[-LAST:].strip()
        raise ShiplogError(
            f"{Path(command[0]).name} ended with {done.returncode}: {said}.",
            hint="report it with the run's folder: the source was written by shiplog.",
        )
    return done.stdout
