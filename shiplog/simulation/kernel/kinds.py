"""One kernel for a kind of ship: ships with the same equations share it, whatever their numbers.

    model.acceleration -> jaxpr -> graph -> derivatives -> without sin, cos … -> code of lanes

What a kind is, is in its key: the model's structure, the shapes of its numbers and how many
coefficients and inputs it has. Of equations that others wrote (a cause of the user's own) the key
is the code that was written. A model that no code can be made of is JAX's, and that is said once.
"""

from __future__ import annotations

import hashlib
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shiplog.machine import trees
from shiplog.simulation.kernel import graph, machine_code
from shiplog.simulation.kernel.machine_code import Level, Library

log = logging.getLogger(__name__)

Write = Callable[[Any, Any], None]  # of a module and each function's sizes: a purpose's loops


@dataclass(frozen=True)
class Purpose:
    """What a kernel is for. `write` writes its loops, of functions of the model by name: `by` says
    by what ν̇ is differentiated, "" for nothing, "state", "state and θ", or "all": state, what
    drives, and θ. `signatures` are the loops' names and a letter for each argument."""

    name: str
    write: Write
    functions: tuple[tuple[str, str], ...]  # name, by
    signatures: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Kernel:
    """Compiled loops of a kind of ship, by name, and how many constants they hoist."""

    library: Library
    functions: dict[str, Callable[..., None]]
    constants: int
    lanes: int

    def prepared(self, model: Any, theta: np.ndarray) -> np.ndarray:
        """What depends on coefficients and sizes alone."""
        fixed = np.concatenate([*(np.ravel(x) for x in trees.flatten(model)[0]), np.ravel(theta)])
        fixed = np.ascontiguousarray(fixed, dtype=float)
        found = np.empty(max(self.constants, 1))
        self.functions["prepare"](pointer(fixed), pointer(found))
        return found


def pointer(values: np.ndarray) -> int:
    assert values.flags.c_contiguous
    return values.ctypes.data


def unset(*shape: int) -> np.ndarray:
    """An array that begins where a cache line does, of any numbers."""
    size = int(np.prod(shape))
    whole = np.empty(size + 8)
    skip = -(whole.ctypes.data // 8) % 8
    return whole[skip : skip + size].reshape(shape)


def aligned(*shape: int) -> np.ndarray:
    """Zeros where a cache line begins."""
    found = unset(*shape)
    found[...] = 0.0
    return found


_known: dict[Any, Kernel | None] = {}
_refused: set[str] = set()
_jaxprs: dict[Any, Any] = {}  # of the kind that was traced last


def kernel(model: Any, purpose: Purpose, driven: int, coefficients: int) -> Kernel | None:
    """The kernel of a model's kind; None where JAX has to do it. `driven` counts actuators (with
    the share of the campaign where the model has it) and the wind's two."""
    level = machine_code.level()
    if level is None:
        return None
    leaves, structure = trees.flatten(model)
    kind = structure, tuple(np.shape(leaf) for leaf in leaves)
    key = (*kind, purpose.name, driven, coefficients, level.name)
    if key not in _known:
        _known[key] = _made(model, kind, purpose, driven, coefficients, level)
    return _known[key]


def plain(name: str, write: Callable[[Any], None], signatures: Sequence[tuple[str, str]]) -> Kernel:
    """Loops that are no model's: `write` writes them into a module. Where the environment wants no
    kernels of models, these are the portable ones."""
    level = machine_code.level() or machine_code.LEVELS[-1]
    key = (name, level.name)
    known = _known.get(key)
    if known is None:
        whose = f"{machine_code.whose(level)} {name}"
        found = machine_code.kept(whose)
        if found is None:
            from shiplog.simulation.kernel.writer import Module

            module = Module(level.lanes)
            write(module)
            found = {}, machine_code.compiled(module.text, level)
            machine_code.keep(whose, *found)
        library = Library(found[1])
        functions = {n: library.function(n, given) for n, given in signatures}
        known = _known[key] = Kernel(library, functions, 0, level.lanes)
    return known


def _made(
    model: Any, kind: tuple, purpose: Purpose, driven: int, coefficients: int, level: Level
) -> Kernel | None:
    structure, shapes = kind
    whose = machine_code.whose(level)
    key = f"{whose} {purpose.name} {driven} {coefficients} {shapes} {structure!r}"
    key = key if trees.ours(structure) else None
    found = machine_code.kept(key) if key else None
    if found is None:
        begin = time.process_time()
        try:
            text, constants = written(model, purpose, driven, coefficients, level.lanes)
        except graph.UnknownOperation as error:
            _refuse(type(model).__name__, str(error))
            return None
        # what others wrote is known by the code that was made of it
        key = key or f"{whose} {hashlib.sha256(text.encode()).hexdigest()}"
        found = machine_code.kept(key)
        if found is None:
            found = {"constants": constants}, machine_code.compiled(text, level)
            machine_code.keep(key, *found)
        log.debug("kernel %s made in %.1f s", purpose.name, time.process_time() - begin)
    facts, code = found
    library = Library(code)
    names = dict((*purpose.signatures, ("prepare", "pp")))
    functions = {name: library.function(name, given) for name, given in names.items()}
    return Kernel(library, functions, facts["constants"], level.lanes)


def _refuse(name: str, why: str) -> None:
    said = f"{name}: {why}"
    if said not in _refused:
        _refused.add(said)
        log.info("JAX runs the model %s: no kernel is made of %s.", name, why)


def written(
    model: Any, purpose: Purpose, driven: int, coefficients: int, lanes: int
) -> tuple[str, int]:
    """LLVM's assembly of a kernel, and how many constants it hoists. Raises UnknownOperation."""
    from shiplog.simulation.kernel.elementary import lowered
    from shiplog.simulation.kernel.functions import Functions
    from shiplog.simulation.kernel.writer import Module

    whole = graph.Graph()
    outputs = {
        name: equations(whole, model, driven, coefficients, by) for name, by in purpose.functions
    }
    plain, module = graph.Graph(), Module(lanes)
    flat = lowered(whole, [node for nodes in outputs.values() for node in nodes], plain)
    functions, sizes, at = Functions(module, plain), {}, 0
    for name, by in purpose.functions:
        nodes = flat[at : at + len(outputs[name])]
        functions.write(name, nodes)
        zeros = frozenset(i for i, node in enumerate(nodes) if plain.value(node) == 0.0)
        sizes[name] = _sizes(driven, coefficients, zeros, by)
        at += len(nodes)
    constants = functions.prepare()
    purpose.write(module, sizes)
    return module.text, constants


def _sizes(driven: int, coefficients: int, zeros: frozenset[int], by: str):
    from shiplog.simulation.kernel.windows import STATES, Sizes

    columns = STATES + driven if by == "all" else STATES
    return Sizes(driven, coefficients if by in ("all", "state and θ") else 0, columns, zeros)


def equations(g: graph.Graph, model: Any, driven: int, coefficients: int, by: str) -> list[int]:
    """Outputs of a function in the graph: ν̇, cos ψ, sin ψ and the derivatives asked for."""
    from shiplog.simulation.kernel.derivatives import gradients
    from shiplog.simulation.kernel.windows import STATES

    found, x, theta = traced(g, model, driven, coefficients)
    heading = x[4]
    outputs = [*found, g.apply("cos", heading), g.apply("sin", heading)]
    if not by:
        return outputs
    moving = x if by == "all" else x[:STATES]
    last = [] if by == "state" else theta
    rows = gradients(g, found, [*moving, *last])
    outputs += [node for row in rows for node in row[: len(moving)]]
    return outputs + [node for row in rows for node in row[len(moving) :]]


def traced(
    g: graph.Graph, model: Any, driven: int, coefficients: int
) -> tuple[list[int], list[int], list[int]]:
    """ν̇ [3] in the graph, its varying inputs (state, actuators, wind) and the coefficients."""
    from shiplog.simulation.kernel import from_jaxpr
    from shiplog.simulation.kernel.windows import STATES

    leaves, structure = trees.flatten(model)
    shapes = tuple(np.shape(leaf) for leaf in leaves)
    actuators = driven - 2
    key = structure, shapes, driven, coefficients
    if key not in _jaxprs:  # the purposes of a kind follow one another

        def acceleration(theta, state, actuator, wind, *numbers):
            whole = trees.unflatten(structure, numbers)
            return whole.acceleration(theta, state, actuator, wind)

        _jaxprs.clear()
        _jaxprs[key] = from_jaxpr.trace(
            acceleration, (coefficients,), (STATES,), (actuators,), (2,), *shapes
        )
    closed = _jaxprs[key]
    x = [g.varying(i) for i in range(STATES + driven)]
    given, at = [], 0
    for shape in (*shapes, (coefficients,)):
        size = int(np.prod(shape))
        nodes = [g.fixed(at + i) for i in range(size)]
        given.append(np.array(nodes, dtype=np.int64).reshape(shape))
        at += size
    *numbers, theta = given
    state, actuator, wind = (
        np.array(part, dtype=np.int64)
        for part in (x[:STATES], x[STATES : STATES + actuators], x[STATES + actuators :])
    )
    (found,) = from_jaxpr.Reader(g).read(closed, [theta, state, actuator, wind, *numbers])
    return [int(node) for node in found.ravel()], x, [int(node) for node in theta]


def contiguous(values: Sequence | np.ndarray, *shape: int) -> np.ndarray:
    """Doubles one after the other. Raises ValueError for another shape: code reads what it is told
    of, and would read what stands behind an array that is too small."""
    found = np.ascontiguousarray(values, dtype=float)
    if shape and found.shape != shape:
        raise ValueError(f"an array has the shape {found.shape}, not {shape}")
    return found
