"""A run of a simulator of one's own: the causes around it are written, and the simulator is asked.

    ν̇ = f(x_w, u, ω + V) + c(x, u, ω; θ),   x_w = x less Rᵀ(ψ) V

f is the simulator, whose equations nobody here has; c and V are of the causes (see
`simulation.foreign_model`). An FMU goes into the FMU that is written, as `given_unit` has it; a
Python function is an argument of the Python that is written.

| the simulator is | model | coefficients of its causes | predictions |
| --- | --- | --- | --- |
| an FMU | fmu, fmu3 | csv, yaml | mcap, parquet, csv |
| a Python function | python | csv, yaml | mcap, parquet, csv |
| logged states | none; extended, every target, of the MMG that stands in | csv, yaml | the same |
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from shiplog.exceptions import ModelError
from shiplog.foreign import source as sources
from shiplog.foreign.source import Source
from shiplog.models.extended import Extended
from shiplog.simulation import foreign_model
from shiplog.training.runs.load_model import ForeignRun, Run

INSTEAD = "mcap, parquet and csv with --voyages have what it predicts"
AROUND = {"fmu": ("fmu", "fmu3"), "callable": ("python",)}  # what the causes can be written as
NUMBERS = ("csv", "yaml")  # of the causes
PREDICTED = ("mcap", "parquet")


@dataclass(frozen=True)
class Function:
    """A Python function as the file that is written asks it.

    returns  "derivative", "acceleration" or "next state", `step` s later
    layout   "rows", "columns" or "row by row": how it takes many at once
    wind     whether its inputs end with the apparent wind
    """

    name: str
    function: str
    sha256: str
    returns: str
    step: float
    layout: str
    wind: bool


def asked(run: Run) -> ForeignRun | None:
    """The run, where the simulator itself is to be asked; None of equations."""
    return run if isinstance(run, ForeignRun) and not run.logged else None


def refuse_unwritable(run: Run, to: str, predicts: bool) -> None:
    """Raises ModelError for a target that a run of a simulator cannot be written as, and
    SimulatorError where the simulator is needed and was not given."""
    if not isinstance(run, ForeignRun):
        return
    name, plain = run.config.foreign.name, run.extension is None
    if predicts:
        if not run.logged:
            given(run)
        return
    if to in NUMBERS or to == "toml":
        if to == "toml" or plain:
            raise ModelError(
                f"{run.name} is a run of {name}, which has no coefficients of shiplog's"
                + ("." if plain else ", and those of its causes begin no training."),
                hint=f"--to {INSTEAD}." if plain else "--to csv and yaml have those of its causes.",
            )
        return
    if run.logged:
        if plain:
            raise ModelError(
                f"{run.name} is of states that were logged, and has no model to write.",
                hint=f"--to {INSTEAD}.",
            )
        return
    kind = run.config.foreign.kind
    if to not in AROUND[kind]:
        raise ModelError(*_reason(kind, name, to))
    given(run)


def given(run: ForeignRun) -> Source:
    """The simulator's file, as it was given in this call. Raises SimulatorError."""
    if run.source is None:
        of = run.config.foreign
        raise sources.absent(run.name, of.name, of.sha256)
    return run.source


def _reason(kind: str, name: str, to: str) -> tuple[str, str]:
    if kind == "fmu":
        return (
            f"{name} is an FMU, whose equations nobody here has: --to {to} cannot be written.",
            f"--to fmu and fmu3 have it inside, with the causes around it; {INSTEAD}.",
        )
    if to in ("fmu", "fmu3"):
        return (
            f"{name} needs Python, and an FMU of shiplog's needs none: it cannot be inside.",
            f"--to python writes the causes around it; {INSTEAD}. Or make an FMU of {name} "
            "yourself, and train a run of that.",
        )
    return (
        f"{name} is a Python function, whose equations nobody here has: --to {to} cannot be "
        "written.",
        f"--to python writes the causes around it; {INSTEAD}.",
    )


def function_of(run: ForeignRun) -> Function:
    of = run.config.foreign
    return Function(
        of.name, of.function or "f", of.sha256, of.returns, of.step, of.layout,
        run.profile.has_wind,
    )  # fmt: skip


def parts(run: ForeignRun) -> tuple[Any, Any]:
    """The model of c, and the function of θ that gives V along x₀ and y₀."""
    model = run.extended(run.config.seeds[0]).model
    assert isinstance(model, Extended)
    rest = foreign_model.rest_of(model)

    def water(theta: Any) -> tuple[Any, Any]:
        north = east = 0.0
        for cause, p in zip(rest.causes, rest.numbers(theta), strict=True):
            if (moving := cause.water(p)) is not None:
                north, east = north + moving[0], east + moving[1]
        return north, east

    return rest, water


def losses(run: ForeignRun) -> tuple[str, ...]:
    of = run.config.foreign
    found = []
    if of.kind == "fmu":
        found.append(
            f"States that {of.name} has besides the ship's six: it begins anew for each "
            "acceleration, as `simulate` asks it."
        )
        found.append(
            f"A licence to pass {of.name} on: the whole of it is inside, as you gave it in this "
            "call; whether others may have it, its owner says."
        )
    else:
        found.append(f"{of.name} itself: the file takes its function as an argument.")
    return tuple(found)
