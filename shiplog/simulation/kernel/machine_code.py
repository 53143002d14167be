"""LLVM's assembly as machine code, on disk and in memory.

The code is for a kind of processor, not for one: AVX-512, AVX2 or what every processor of the
family has. A file of it says version, processor and digest; one that does not fit, or is damaged,
is made again.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import logging
import os
import platform
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from shiplog.machine import disk_cache, files

log = logging.getLogger(__name__)

FOLDER = "kernels"
LEVEL = "SHIPLOG_KERNEL"  # environment: one of LEVELS, or "off": JAX then runs the models
FORM = 1  # of the files


@dataclass(frozen=True)
class Level:
    """A kind of processor: `lanes` doubles in a vector, LLVM's names for it and for what it must
    have."""

    name: str
    lanes: int
    processor: str
    needs: tuple[str, ...] = ()
    features: str = ""


LEVELS = (
    Level("avx512", 8, "x86-64-v4", ("avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"),
          "-prefer-256-bit"),
    Level("avx2", 4, "x86-64-v3", ("avx2", "fma", "bmi2")),
    Level("portable", 2, ""),
)  # fmt: skip


@lru_cache
def _llvm() -> Any:
    """llvmlite's binding, ready for this machine."""
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    return binding


@lru_cache
def level(wanted: str | None = None) -> Level | None:
    """The best that this processor has, or the one that the environment's LEVEL names, where the
    processor has it. None where that is "off", or LLVM cannot be loaded."""
    wanted = wanted or os.environ.get(LEVEL, "")
    if wanted == "off":
        return None
    try:
        has = _llvm().get_host_cpu_features()
    except (ImportError, OSError, RuntimeError) as error:
        log.warning(
            "JAX runs all models, and diagnose cannot run: LLVM cannot be loaded (%s).", error
        )
        return None
    fitting = [one for one in LEVELS if all(has.get(feature) for feature in one.needs)]
    names = [one.name for one in LEVELS]
    at = names.index(wanted) if wanted in names else 0
    return next(one for one in fitting if names.index(one.name) >= at)


def compiled(text: str, of: Level) -> bytes:
    """Machine code, as an object file, of a module of LLVM's assembly."""
    llvm = _llvm()
    machine = _machine(of)
    module = llvm.parse_assembly(text)
    module.triple = llvm.get_process_triple()
    module.data_layout = str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    # what is to be a vector is written as one
    options.loop_vectorization = options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return machine.emit_object(module)


def _machine(of: Level) -> Any:
    llvm = _llvm()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    return target.create_target_machine(
        cpu=of.processor, features=of.features, opt=2, reloc="pic", codemodel="jitdefault", jit=True
    )


class Library:
    """Functions of an object file, by name; arrays of numpy are passed as pointers."""

    def __init__(self, code: bytes) -> None:
        llvm = _llvm()
        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine(LEVELS[-1]))
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._engine.finalize_object()

    def function(self, name: str, arguments: str) -> Callable[..., None]:
        """`arguments`: a letter each, p pointer, i whole number, d double. Raises KeyError."""
        address = self._engine.get_function_address(name)
        if not address:
            raise KeyError(name)
        kinds = {"p": ctypes.c_void_p, "i": ctypes.c_int64, "d": ctypes.c_double}
        return ctypes.CFUNCTYPE(None, *(kinds[a] for a in arguments))(address)


# --- on disk ---------------------------------------------------------------------------------


def path_of(key: str) -> Path:
    return disk_cache.folder() / FOLDER / f"{hashlib.sha256(key.encode()).hexdigest()}.kernel"


def kept(key: str) -> tuple[dict[str, Any], bytes] | None:
    """Facts and machine code that were kept under this key; None where there are none, or they
    are damaged."""
    try:
        head, _, code = path_of(key).read_bytes().partition(b"\n")
        facts = json.loads(head)
        good = facts.pop("sha256") == hashlib.sha256(code).hexdigest() and facts.pop("key") == key
        return (facts, code) if good else None
    except (OSError, ValueError, KeyError, AttributeError, TypeError) as error:
        log.debug("no kernel: %s", error)
        return None


def keep(key: str, facts: dict[str, Any], code: bytes) -> None:
    """For later processes; where the disk does not take it, this one has it all the same."""
    head = {**facts, "key": key, "sha256": hashlib.sha256(code).hexdigest()}
    path = path_of(key)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with files.whole(path) as partial:
            partial.write_bytes(json.dumps(head).encode() + b"\n" + code)
        disk_cache.trim()
    except OSError as error:
        log.warning("A kernel could not be kept, so that it is made again next time: %s", error)


def whose(of: Level) -> str:
    """Of a key: this form, program, LLVM and kind of processor."""
    llvm = _llvm()
    version = ".".join(map(str, llvm.llvm_version_info))
    return f"{FORM} {disk_cache.source().hex()} {version} {platform.machine()} {of.name}"
