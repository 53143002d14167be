"""JAX in double precision where shiplog computes, and functions that are traced once for all ships
that are alike.

Double precision is of the thread and of the `with` block: whoever imports shiplog keeps the
precision of JAX that they have. Functions that are traced take arrays of numpy and return them, so
that no array of double precision is computed with in single precision afterwards.

JAX needs seconds to trace a ship's equations with their derivatives, and milliseconds to load
what it has traced before. All that a trace depends on is in its key, this program's source with
it; equations that others wrote (a cause of the user's own) are traced anew each time. What JAX
compiles it keeps in shiplog's folder, too, while a function of shiplog's is compiled and no longer:
a process that imports shiplog has the environment and the settings of JAX that it had.
"""

from __future__ import annotations

import hashlib
import logging
import threading
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import jax
import numpy as np
from jax import export
from jax.core import Tracer
from jax.experimental.compilation_cache import compilation_cache

from shiplog.machine import disk_cache, files, trees

log = logging.getLogger(__name__)
trees.tell_jax()

# The emitters of fused loops need twice the time to compile a ship's derivatives, and what they
# compile is no faster. Measured with `python -m pipelines.experiments.benchmarks.compiling`.
COMPILER = {"xla_cpu_use_fusion_emitters": False}
FOLDER = "jax_compilation_cache_dir"
LEAST_BYTES = (
    "jax_persistent_cache_min_entry_size_bytes"  # which JAX sets where it opens its folder
)


def double() -> AbstractContextManager:
    """JAX in double precision, in this thread and until the block ends: float32 sensitivities do
    not distinguish causes."""
    return jax.enable_x64(True)


class _Kept:
    """JAX's folder for what it compiles. It is one of the process, and JAX looks at its name once:
    so it is set while any thread is in the block, and what JAX knows of it is forgotten twice. A
    process that has such a folder keeps its own (the command line sets shiplog's).
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._before: dict[str, Any] = {}

    @contextmanager
    def __call__(self) -> Iterator[None]:
        with self._lock:
            if not self._inside and getattr(jax.config, FOLDER) is None:
                self._set()
            self._inside += 1
        try:
            yield
        finally:
            with self._lock:
                self._inside -= 1
                if not self._inside and self._before:
                    self._restore()

    def _set(self) -> None:
        wanted = disk_cache.kept_by_jax()
        self._before = {name: getattr(jax.config, name) for name in (*wanted, LEAST_BYTES)}
        for name, value in wanted.items():
            jax.config.update(name, value)
        compilation_cache.reset_cache()
        disk_cache.trim_when_done()

    def _restore(self) -> None:
        for name, value in self._before.items():
            jax.config.update(name, value)
        self._before = {}
        compilation_cache.reset_cache()


kept_on_disk = _Kept()


class Traced:
    """`jax.jit` of a function of arrays and pytrees, in double precision; what is given by keyword
    is static. The arrays that it returns are numpy's, to be read only."""

    def __init__(self, function: Callable) -> None:
        self._function = function
        self._known: dict[Hashable, Callable] = {}

    def __call__(self, *arguments: Any, **static: Hashable) -> Any:
        leaves, tree = trees.flatten(arguments)
        if any(isinstance(leaf, Tracer) for leaf in leaves):
            return self._function(*arguments, **static)  # within what is traced itself
        leaves = [leaf if hasattr(leaf, "dtype") else np.asarray(leaf) for leaf in leaves]
        shapes = tuple((leaf.shape, str(leaf.dtype)) for leaf in leaves)
        key = (tree, shapes, tuple(sorted(static.items())))
        with double():
            if (known := self._known.get(key)) is not None:
                return jax.tree.map(np.asarray, known(*leaves))
            with kept_on_disk():  # JAX compiles at the first call
                made = self._compiled(tree, leaves, static, repr(key))
                found = jax.tree.map(np.asarray, made(*leaves))
            self._known[key] = made
            return found

    def _compiled(
        self, tree: Any, leaves: list, static: Mapping[str, Hashable], key: str
    ) -> Callable:
        def flat(*given: Any) -> Any:
            return self._function(*trees.unflatten(tree, given), **static)

        if not trees.ours(tree):
            return jax.jit(flat, compiler_options=COMPILER)
        name = f"{self._function.__module__}.{self._function.__qualname__}"
        digest = hashlib.sha256(disk_cache.source() + f"{jax.__version__} {name} {key}".encode())
        kept = disk_cache.folder() / "traced" / f"{digest.hexdigest()}.bin"
        try:
            found = export.deserialize(bytearray(kept.read_bytes()))
        except Exception as error:  # not there, or broken in whatever way
            log.debug("%s is traced: %s", name, error)
            shapes = [jax.ShapeDtypeStruct(leaf.shape, leaf.dtype) for leaf in leaves]
            found = export.export(jax.jit(flat))(*shapes)
            _keep(kept, found)
        return jax.jit(found.call, compiler_options=COMPILER)


def traced(function: Callable) -> Traced:
    """Instead of `jax.jit`."""
    return Traced(function)


def _keep(kept: Any, found: export.Exported) -> None:
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        with files.whole(kept) as partial:
            partial.write_bytes(found.serialize())
    except OSError as error:
        log.info("not kept: %s", error)
