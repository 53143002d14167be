"""Disk cache of the nominal campaign: its converged fit, computed once for a model.

The key holds all that the fit depends on, this program's source and the versions of the libraries
that compute it included: no entry is ever stale.
"""

from __future__ import annotations

import hashlib
import logging
import zipfile
from collections.abc import Iterable
from dataclasses import astuple
from pathlib import Path as File

import numpy as np
import scipy

from shiplog.diagnosis.linear.linear_segments import Path
from shiplog.diagnosis.noise import discrepancy
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.nominal import campaign_characteristics, nominal_fit
from shiplog.diagnosis.nominal.campaign_characteristics import Characteristics
from shiplog.diagnosis.nominal.nominal_fit import Converged
from shiplog.machine import disk_cache, files, trees
from shiplog.models.causes import Setting
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.voyages.rows.recording import Record

PROCESS_NOISE = ("noise", "acceleration", "start", "coloured", "fade")
# Field → its name in the file.
TIME_FIELDS = {"time": "time", "bin": "bin", "node_step": "knot",
               "intermittent_time": "intermittent_time"}  # fmt: skip
LIBRARIES = (np, scipy)

log = logging.getLogger(__name__)


def converged(model: Extended, setting: Setting, start: Start, record: Record) -> Converged:
    """`nominal_fit.converged`, computed once for a model and a campaign."""
    kept = disk_cache.folder() / "settled" / f"{_key(model, setting, start, record)}.npz"
    known = _read(kept)
    if known is not None:
        return _converged(known)
    log.info("the nominal voyages are fitted once for a model, and kept")
    found = nominal_fit.converged(model, setting, start, record, seen=discrepancy.MODELLED)
    _keep(
        kept,
        {"theta": found.theta} | _path_arrays(found.path) | _process_noise(found.process_noise),
    )
    return found


def characteristics(
    model: Extended, setting: Setting, start: Start, record: Record, at: Converged
) -> Characteristics:
    """`campaign_characteristics.characteristics`, worked out once for a model and a campaign."""
    key = _key(model, setting, start, record)
    kept = disk_cache.folder() / "settled" / f"{key}.characteristics.npz"
    known = _read(kept)
    if known is not None:
        given = {k: dict(zip(known[f"{k}_names"].tolist(), known[f"{k}_values"].tolist(),
                             strict=True)) for k in ("deviation", "size")}  # fmt: skip
        return Characteristics(
            _read_process_noise(known), given["deviation"], given["size"],
            float(known["apart"]), float(known["share"]), float(known["noise"]), known["weight"],
            _path(known),
        )  # fmt: skip
    found = campaign_characteristics.characteristics(model, setting, start, record, at)
    arrays = _path_arrays(found.path) | _process_noise(found.process_noise) | {
        "apart": found.apart, "share": found.share, "noise": found.noise, "weight": found.weight,
    }  # fmt: skip
    for name in ("deviation", "size"):
        values = getattr(found, name)
        arrays |= {f"{name}_names": np.array(list(values)),
                   f"{name}_values": np.array(list(values.values()))}  # fmt: skip
    _keep(kept, arrays)
    return found


def is_kept(model: Extended, setting: Setting, start: Start, record: Record) -> bool:
    """Whether both have been worked out before."""
    folder, key = disk_cache.folder() / "settled", _key(model, setting, start, record)
    return all((folder / f"{key}{end}").exists() for end in (".npz", ".characteristics.npz"))


def _read(kept: File) -> dict | None:
    """Arrays of a file; None where it is missing or damaged, and has to be computed again."""
    try:
        with np.load(kept, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _process_noise(process_noise: ProcessNoise) -> dict:
    whole = {f"process_noise_{name}": getattr(process_noise, name) for name in PROCESS_NOISE}
    return whole | {name: getattr(process_noise, field) for field, name in TIME_FIELDS.items()}


def _read_process_noise(arrays: dict) -> ProcessNoise:
    times = {field: float(arrays[name]) for field, name in TIME_FIELDS.items()}
    return ProcessNoise(**times, **{n: arrays[f"process_noise_{n}"] for n in PROCESS_NOISE})


def _converged(arrays: dict) -> Converged:
    return Converged(arrays["theta"], _path(arrays), _read_process_noise(arrays))


def _path_arrays(path: Path) -> dict:
    return {"start": path.start, "acceleration": path.acceleration}


def _path(arrays: dict) -> Path:
    return Path(arrays["start"], arrays["acceleration"])


def _keep(kept: File, arrays: dict) -> None:
    """Whole or not at all; a cache that cannot be written is no fault."""
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        with files.whole(kept) as partial, partial.open("wb") as file:
            np.savez(file, **arrays)
    except OSError as error:
        log.info("not kept: %s", error)


def _key(model: Extended, setting: Setting, start: Start, record: Record) -> str:
    leaves, shape = trees.flatten(model)
    digest = hashlib.sha256(disk_cache.source())
    versions = [(library.__name__, library.__version__) for library in LIBRARIES]
    for word in (
        versions,
        shape,
        setting.scale,
        setting.profile,
        record.names,
        record.step,
        record.timescale,
    ):
        digest.update(repr(word).encode())
    arrays: Iterable = (
        *leaves, *astuple(start), record.voyage, record.time, record.share, record.starts,
        record.measured, record.state, record.actuator, record.wind,
    )  # fmt: skip
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
