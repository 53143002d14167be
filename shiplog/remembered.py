"""Where the campaign that a model was made on settles: worked out once, kept in the user's cache.

All that it depends on is in its key, this program's source with it: nothing here is ever stale.
"""

from __future__ import annotations

import hashlib
import logging
import os
import zipfile
from collections.abc import Iterable
from dataclasses import astuple
from pathlib import Path as File

import jax
import numpy as np

from shiplog import cache, reference
from shiplog.causes import Setting
from shiplog.evidence import Unrest
from shiplog.linearise import Path
from shiplog.models.extended import Extended
from shiplog.record import Record
from shiplog.reference import Settled, Start

UNREST = ("noise", "push", "start", "coloured", "fade")

log = logging.getLogger(__name__)


def settled(model: Extended, setting: Setting, start: Start, record: Record) -> Settled:
    """`reference.settled`, worked out once for a model and a campaign."""
    kept = cache.folder() / "settled" / f"{_key(model, setting, start, record)}.npz"
    try:
        with np.load(kept, allow_pickle=False) as arrays:
            return _settled(arrays)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        pass  # not there, or broken: worked out again
    log.info("where the nominal voyages settle: worked out once for a model and kept")
    found = reference.settled(model, setting, start, record)
    try:
        _keep(kept, found)
    except OSError as error:
        log.info("not kept: %s", error)
    return found


def _settled(arrays) -> Settled:
    path = Path(arrays["start"], arrays["push"])
    unrest = {name: arrays[f"unrest_{name}"] for name in UNREST}
    return Settled(arrays["theta"], path, Unrest(time=float(arrays["time"]), **unrest))


def _keep(kept: File, found: Settled) -> None:
    kept.parent.mkdir(parents=True, exist_ok=True)
    partial = kept.with_name(f"{kept.stem}.{os.getpid()}.partial")
    with partial.open("wb") as file:
        np.savez(
            file, theta=found.theta, start=found.path.start, push=found.path.push,
            time=found.unrest.time,
            **{f"unrest_{name}": getattr(found.unrest, name) for name in UNREST},
        )  # fmt: skip
    partial.replace(kept)


def _key(model: Extended, setting: Setting, start: Start, record: Record) -> str:
    leaves, shape = jax.tree.flatten(model)
    digest = hashlib.sha256(cache.source())
    for word in (shape, setting.scale, setting.profile, record.names, record.step):
        digest.update(repr(word).encode())
    arrays: Iterable = (
        *leaves, *astuple(start), record.voyage, record.time, record.share, record.starts,
        record.seen, record.state, record.actuator, record.wind,
    )  # fmt: skip
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
