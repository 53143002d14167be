"""The GPU that torch can use, if there is one."""

from __future__ import annotations

import torch

from shiplog.exceptions import RunError

CPU = "cpu"  # what provenance has for the processor
Device = torch.device


def find() -> torch.device:
    """The GPU, with 32-bit products as the recipe has them: no TF32. Raises RunError without."""
    if not torch.cuda.is_available():
        built = torch.version.cuda  # None of a torch for processors
        found = f"is built for CUDA {built} and finds none" if built else "is built without CUDA"
        raise RunError(
            f"--device cuda needs an NVIDIA GPU, and torch {torch.__version__} {found}.",
            hint="leave --device out to train on the processor, or install a torch with CUDA as "
            "pytorch.org describes.",
        )
    torch.set_float32_matmul_precision("highest")
    return torch.device("cuda")


def name(device: torch.device) -> str:
    """Of what trains, for provenance."""
    return f"cuda: {torch.cuda.get_device_name()}" if device.type == "cuda" else CPU
