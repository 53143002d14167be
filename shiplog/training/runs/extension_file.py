"""Causes that a diagnosis put into a run, as its folder keeps them.

<run>/extension.json  extension.safetensors   the causes, their numbers, and the base's
<run>/extension-<k>.py    where some are a user's own: their code, to be read. It is never run
                          from here: a run may be anybody's
"""

from __future__ import annotations

import logging
import shutil
from collections.abc import Sequence
from pathlib import Path

from shiplog.exceptions import RunError, listed
from shiplog.machine import files
from shiplog.machine.paths import refuse_taken
from shiplog.models.causes import CATALOGUE, Cause
from shiplog.simulation.extended_simulator import ExtendedSimulator, Extension
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.settings import run_files

log = logging.getLogger(__name__)

ANEW = (  # what of a run is not of the run that extends it
    ".*", "errors.parquet", "rollouts.parquet", "*.rrd", "band.safetensors", "extension.*",
    "extension-*.py",
)  # fmt: skip


def read(folder: RunFolder, own: Sequence[Cause] = ()) -> Extension | None:
    """The causes in a run as they were written; None for a plain one.

    own   causes of the user's own

    Raises RunError for a cause that was not given.
    """
    path = folder.path / "extension.json"
    if not path.is_file():
        return None
    content = run_files.json_of(path)
    known = {cause.label for cause in (*CATALOGUE, *own)}
    try:
        entries = [(str(entry["label"]), str(entry["name"])) for entry in content["causes"]]
    except (KeyError, TypeError) as error:
        raise run_files.unreadable(path, error) from error
    lacking = [label for label, name in entries if not {label, name} & known]
    if lacking:
        code = listed(str(p) for p in sorted(folder.path.glob("extension-*.py")))
        raise RunError(
            f"The run {folder.name} was extended by {listed(lacking)}, which is no cause of "
            "shiplog's.",
            hint="give the file that defines it with --cause FILE"
            + ("." if code == "none" else f"; a copy to look over first: {code}."),
        )
    arrays = run_files.arrays(folder.path / "extension.safetensors")
    try:
        return Extension.from_record(content, arrays, own)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise run_files.unreadable(path, error) from error


def extend(
    folder: RunFolder, out: Path, simulator: ExtendedSimulator, own_files: Sequence[Path] = ()
) -> Path:
    """A new run, `out`: everything of the old one, and the causes; `own_files` define those that
    are not in the catalogue. Raises RunError for a taken name."""
    refuse_taken(out, "--extend")
    content, arrays = Extension.kept(simulator, len(simulator.model.base.names))
    own = any(cause.user for cause in simulator.model.causes)
    with files.whole_folder(out) as new:
        anew = shutil.ignore_patterns(*ANEW)
        shutil.copytree(folder.path, new, ignore=anew, dirs_exist_ok=True)
        for i, path in enumerate(own_files if own else ()):
            shutil.copy(path, new / f"extension-{i}.py")
        files.write_json(new / "extension.json", content | {"base": folder.name})
        run_files.save_arrays(new / "extension.safetensors", arrays)
    log.info("%s with its causes is the run %s", folder.name, out)
    return out
