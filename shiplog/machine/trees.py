"""Models as their numbers and what they are without them: a tree of dataclasses, tuples and
dictionaries, whose leaves are numbers and arrays.

A class says which of its fields hold numbers (`tree`), or how they are taken out (`register`). JAX
is told of these classes when it is there, or when something of shiplog's needs it (`tell_jax`).
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, TypeVar

import numpy as np

Leaves = list[Any]
T = TypeVar("T")


@dataclass(frozen=True)
class Structure:
    """What a tree is without its leaves: its kind, what is fixed of it, and its branches'. Equal
    for trees that differ in their numbers only."""

    kind: Any
    fixed: Any = None
    branches: tuple[Structure, ...] = ()
    leaf: bool = False


@dataclass(frozen=True)
class _Kind:
    flat: Callable[[Any], tuple[Iterable[Any], Any]]
    whole: Callable[[Any, Iterable[Any]], Any]


_kinds: dict[type, _Kind] = {}
_told: set[type] = set()
LEAF = Structure(None, leaf=True)


def register(
    kind: type,
    flat: Callable[[Any], tuple[Iterable[Any], Any]],
    whole: Callable[[Any, Iterable[Any]], Any],
) -> None:
    """`flat` gives branches and what is fixed, `whole` is its inverse."""
    _kinds[kind] = _Kind(flat, whole)
    if "jax" in sys.modules:
        tell_jax()


def tree(data: Iterable[str], fixed: Iterable[str] = ()) -> Callable[[type[T]], type[T]]:
    """Of a dataclass: fields that hold numbers or trees of them, and those that are fixed."""
    numbers, still = tuple(data), tuple(fixed)

    def decorated(kind: type[T]) -> type[T]:
        def flat(one: Any) -> tuple[list[Any], tuple[Any, ...]]:
            of_it = [getattr(one, name) for name in numbers]
            return of_it, tuple(getattr(one, name) for name in still)

        def whole(known: tuple[Any, ...], branches: Iterable[Any]) -> Any:
            values = dict(zip(numbers, branches, strict=True))
            return kind(**values, **dict(zip(still, known, strict=True)))

        register(kind, flat, whole)
        return kind

    return decorated


def tell_jax() -> None:
    """Of the classes that it has not been told of."""
    from jax import tree_util

    for kind, how in _kinds.items():
        if kind not in _told:
            _told.add(kind)
            tree_util.register_pytree_node(kind, how.flat, how.whole)


def flatten(one: Any) -> tuple[Leaves, Structure]:
    """Leaves, and the structure without them. A class that only JAX knows, as a user's own model,
    is asked of JAX."""
    leaves: Leaves = []
    return leaves, _structure(one, leaves)


def _structure(one: Any, leaves: Leaves) -> Structure:
    if one is None:
        return Structure(type(None))
    if (how := _kinds.get(type(one))) is not None:
        branches, fixed = how.flat(one)
        return Structure(type(one), fixed, tuple(_structure(b, leaves) for b in branches))
    if isinstance(one, tuple | list) and type(one) in (tuple, list):
        return Structure(type(one), None, tuple(_structure(b, leaves) for b in one))
    if type(one) is dict:
        names = tuple(sorted(one))
        return Structure(dict, names, tuple(_structure(one[n], leaves) for n in names))
    if not isinstance(one, np.ndarray | float | int) and "jax" in sys.modules:
        import jax

        found, known = jax.tree.flatten(one)
        if not (len(found) == 1 and found[0] is one):
            leaves += found
            return Structure("jax", known, (LEAF,) * len(found))
    leaves.append(one)
    return LEAF


def unflatten(structure: Structure, leaves: Iterable[Any]) -> Any:
    """The inverse of `flatten`."""
    return _whole(structure, iter(leaves))


def _whole(of: Structure, leaves: Iterator[Any]) -> Any:
    if of.leaf:
        return next(leaves)
    branches = [_whole(branch, leaves) for branch in of.branches]
    if of.kind is type(None):
        return None
    if of.kind == "jax":
        import jax

        return jax.tree.unflatten(of.fixed, branches)
    if of.kind is dict:
        return dict(zip(of.fixed, branches, strict=True))
    if of.kind in (tuple, list):
        return of.kind(branches)
    return _kinds[of.kind].whole(of.fixed, branches)


def ours(of: Structure) -> bool:
    """Whether all that is fixed in it is of this program: then its `repr` and the source say what
    it does."""
    if of.kind == "jax":
        return False
    own = of.leaf or (_ours(of.kind) and _all_ours(of.fixed))
    return own and all(ours(branch) for branch in of.branches)


def _all_ours(fixed: Any) -> bool:
    if isinstance(fixed, tuple | list):
        return all(_all_ours(one) for one in fixed)
    inner = [getattr(fixed, f.name) for f in fields(fixed)] if is_dataclass(fixed) else []
    return _ours(type(fixed)) and _all_ours(inner)


def _ours(kind: type) -> bool:
    return kind.__module__.split(".")[0] in ("builtins", "shiplog")
