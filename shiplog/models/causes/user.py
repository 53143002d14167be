"""Causes of the user's own: a Python file with classes of `shiplog.models.causes.Cause`."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shiplog.exceptions import RunError
from shiplog.machine.paths import check_causes
from shiplog.models.causes import CATALOGUE, Cause

# What a verdict or its ranking may say in addition to the names of the catalogue.
ANSWERS = {"side_thrust", "none", "unknown", "undecided", "coverage", "external"}


def load(paths: Sequence[Path]) -> tuple[Cause, ...]:
    """Every cause that the files define. Raises RunError for a file that cannot be run, holds
    none, or takes a name of the catalogue or of another answer."""
    found: list[Cause] = []
    for path in paths:
        found += _of(Path(path))
    taken = {cause.name for cause in CATALOGUE} | ANSWERS
    for cause in found:
        if cause.name in taken:
            raise RunError(
                f"There is a cause or an answer {cause.name!r} already.",
                hint="give yours another `name`.",
            )
        taken.add(cause.name)
    return tuple(found)


def _of(path: Path) -> list[Cause]:
    check_causes([path])
    from shiplog.machine.jit_cache import double

    name = f"shiplog_user_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with double():  # constants of JAX, too
            spec.loader.exec_module(module)
    except Exception as error:  # whatever a user's own code may raise
        raise RunError(
            f"{path} cannot be run: {type(error).__name__}: {error}.", hint="mend it first."
        ) from error
    kinds = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Cause) and value.__module__ == name
    ]
    causes = []
    for kind in kinds:
        lacking = [n for n in ("name", "kind", "story", "equation", "parameters")
                   if not hasattr(kind, n)]  # fmt: skip
        if lacking:
            raise RunError(
                f"{path}: {kind.__name__} has no {', '.join(lacking)}.",
                hint="a cause has name, kind, story, equation, parameters and one hook.",
            )
        kind.user = True
        causes.append(_made(path, kind))
    if not causes:
        raise RunError(
            f"{path} defines no cause.",
            hint="derive a class from shiplog.models.causes.Cause in it, with a name and one hook.",
        )
    return causes


def _made(path: Path, kind: type[Cause]) -> Cause:
    """Its cause, whose equation can be written with its parameters. Raises RunError."""
    try:
        made = kind()
        shown = dict.fromkeys(p.name for p in made.parameters) | made.displayed(
            np.zeros(made.count)
        )
    except Exception as error:  # a field without a default, say
        raise RunError(
            f"{path}: {kind.__name__}() cannot be made: {type(error).__name__}: {error}.",
            hint="a cause is made without arguments: give each field a default.",
        ) from error
    try:
        made.equation.format(**dict.fromkeys(shown, 0.0))
    except (LookupError, ValueError) as error:
        raise RunError(
            f"{path}: the equation of {kind.__name__} cannot be written: {made.equation!r}.",
            hint=f"only parameters stand in braces: {', '.join(shown)}; others are {{{{}}}}.",
        ) from error
    return made
