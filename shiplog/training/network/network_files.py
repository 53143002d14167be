"""A network as its run folder keeps it: scaling, weights, checkpoints. Torch is needed for these.

scaling.safetensors                           mean and std of inputs and accelerations
<seed>/model.safetensors  training.parquet    weights; epoch, losses; never redone
<seed>/checkpoint.safetensors                 while the paper's recipe trains it
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path

import polars as pl
import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file

from shiplog.exceptions import UnreadableError
from shiplog.machine import files
from shiplog.models.feedforward import FeedForward, Scaling
from shiplog.training.network.network_training import HISTORY, Progress
from shiplog.training.settings import run_files

log = logging.getLogger(__name__)


def save_scaling(folder: Path, scaling: Scaling) -> None:
    tensors = {name: getattr(scaling, name).contiguous() for name in Scaling.__slots__}
    _save(folder / "scaling.safetensors", tensors)


def scaling(folder: Path) -> Scaling:
    """Raises UnreadableError."""
    path = folder / "scaling.safetensors"
    tensors = _tensors(path)
    try:
        return Scaling(*(tensors[name] for name in Scaling.__slots__))
    except KeyError as error:
        raise run_files.unreadable(path, f"it lacks {error}") from error


def save(folder: Path, progress: Progress) -> None:
    """The best weights and the history; the checkpoint has served its purpose."""
    folder.mkdir(exist_ok=True)
    _save(folder / "model.safetensors", _named(progress.best_weights))
    history = pl.DataFrame(progress.history, schema=list(HISTORY), orient="row")
    files.write_frame(folder / "training.parquet", history)  # last: `finished` looks for it
    (folder / "checkpoint.safetensors").unlink(missing_ok=True)


def fill(model: FeedForward, folder: Path) -> FeedForward:
    """The network with the weights of a seed, in float64. Raises RunError."""
    path = folder / "model.safetensors"
    tensors = _tensors(path)
    try:
        with torch.no_grad():
            for name, parameter in zip(_named(model.weights), model.weights, strict=True):
                parameter.copy_(tensors[name])
    except (KeyError, RuntimeError) as error:  # of another size than the settings say
        raise run_files.unreadable(path, error) from error
    return model.double()


def save_checkpoint(folder: Path, progress: Progress) -> None:
    """Everything a killed training needs to go on as if nothing had happened."""
    folder.mkdir(exist_ok=True)
    tensors = {
        **_named(progress.weights),
        **{f"best.{name}": w for name, w in _named(progress.best_weights).items()},
        **{f"moment.{i:02d}": m.contiguous() for i, m in enumerate(progress.moments)},
        "history": torch.tensor(progress.history, dtype=torch.float64),
        "numbers": torch.tensor(
            [progress.best, progress.first, progress.smoothed, progress.steps],
            dtype=torch.float64,
        ),
    }
    if progress.stream is not None:
        tensors["stream"] = progress.stream
    _save(folder / "checkpoint.safetensors", tensors)


def load_checkpoint(folder: Path) -> Progress | None:
    """Where an unfinished seed stands; None where it begins, as with a checkpoint of no use."""
    path = folder / "checkpoint.safetensors"
    if not path.is_file():
        return None
    try:
        return _progress(_tensors(path))
    except (UnreadableError, KeyError, IndexError, ValueError) as error:
        log.warning("%s cannot be read, its training begins anew: %s", path, error)
        return None


def _progress(tensors: Mapping[str, torch.Tensor]) -> Progress:
    rows = [(int(row[0]), *row[1:]) for row in tensors["history"].tolist()]
    best, first, smoothed, steps = tensors["numbers"].tolist()
    order = list(_named([torch.empty(0)] * sum(n.startswith("layer") for n in tensors)))
    return Progress(
        epoch=rows[-1][0],
        weights=[tensors[name] for name in order],
        best_weights=[tensors[f"best.{name}"] for name in order],
        best=best,
        first=first,
        smoothed=smoothed,
        moments=[tensors[n] for n in sorted(tensors) if n.startswith("moment.")],
        steps=int(steps),
        stream=tensors.get("stream"),
        history=rows,
    )


def _named(weights: list[torch.Tensor]) -> dict[str, torch.Tensor]:
    return {
        f"layer{i // 2:02d}.{('weight', 'bias')[i % 2]}": w.contiguous()
        for i, w in enumerate(weights)
    }


def _tensors(path: Path) -> dict[str, torch.Tensor]:
    """Raises UnreadableError."""
    try:
        return load_file(path)
    except (OSError, SafetensorError) as error:
        raise run_files.unreadable(path, error) from error


def _save(path: Path, values: dict[str, torch.Tensor]) -> None:
    with files.whole(path) as partial:
        save_file(values, partial)
