"""limits.toml: read, and in a user's words what is wrong with one."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, ValidationError, create_model

from shiplog.exceptions import ShiplogError, listed, nearest
from shiplog.models.causes import Cause
from shiplog.nomenclature.channels import STATE, WINDOW
from shiplog.report.evaluation.text_table import one_line
from shiplog.report.gate.cause_names import check_cause, check_size
from shiplog.report.gate.window_limits import KINDS
from shiplog.ship_profile.file import MESSAGES
from shiplog.ship_profile.toml_section import Section

VERDICTS = ("named", "none", "unknown", "undecided", "coverage", "external")
HELP = "docs/use/gate.md has every key"


class LimitsError(ShiplogError):
    """limits.toml names nothing, or something that there is not."""


class Strict(Section):
    """A number is a number: neither a text nor true."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


Positive = Annotated[float, Field(gt=0.0)]
Share = Annotated[float, Field(gt=0.0, le=1.0)]
Names = Annotated[tuple[str, ...], Field(min_length=1, strict=False)]


def _optional(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {key: (kind | None, None) for key, kind in fields.items()}


# [simulation] and [voyages.NAME]: a key a kind, None where it is not limited.
Simulation = create_model(
    "Simulation",
    __base__=Strict,
    **_optional({kind.key: Share if kind.most == 1.0 else Positive for kind in KINDS}),
)
# [band]: share inside the 90 % band, at least, of each channel of the state.
Band = create_model("Band", __base__=Strict, **_optional({c.name: Share for c in STATE}))


class Diagnosis(Strict):
    """[diagnosis]: allowed verdicts, the only causes that may be named, and those that must not."""

    allowed: Annotated[
        tuple[Literal["named", "none", "unknown", "undecided", "coverage", "external"], ...] | None,
        Field(min_length=1, strict=False),
    ] = None
    causes_allowed: Annotated[tuple[str, ...] | None, Field(strict=False)] = None
    causes_not_allowed: Names | None = None


class Limits(Strict):
    """A whole limits.toml.

    window_s    s, length of the windows that the limits of [simulation] and [voyages] are of
    simulation  means over all windows, key → limit
    voyages     of each voyage that a name or shell pattern fits, key → limit
    band        channel → share inside the 90 % band, at least
    diagnosis   allowed verdicts and causes
    sizes       cause → parameter → its largest size, in the catalogue's unit
    """

    window_s: Annotated[int, Field(gt=0)] = WINDOW
    simulation: Simulation = Simulation()  # type: ignore[valid-type]
    voyages: dict[str, Simulation] = {}  # type: ignore[valid-type]  # noqa: RUF012
    band: Band = Band()  # type: ignore[valid-type]
    diagnosis: Diagnosis = Diagnosis()
    sizes: dict[str, Annotated[dict[str, Positive], Field(min_length=1)]] = {}  # noqa: RUF012

    @property
    def of_windows(self) -> bool:
        """Whether a limit needs the simulation to be compared with the voyages."""
        return bool(
            given(self.simulation) or given(self.band) or any(map(given, self.voyages.values()))
        )

    @property
    def of_verdict(self) -> bool:
        """Whether a limit needs a diagnosis."""
        return bool(given(self.diagnosis) or self.sizes)


def given(section: Section) -> dict[str, Any]:
    """Key → limit of those that the file has."""
    return {key: value for key, value in section if value is not None}


def load(path: Path) -> Limits:
    """Raises LimitsError for a file that is not there, is no TOML, has a key or a value that there
    cannot be, or no limit at all."""
    return parse(_text(path), str(path))


def parse(text: str, source: str) -> Limits:
    """As `load`. `source`: what messages call the text."""
    try:
        limits = Limits.model_validate(tomllib.loads(text))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise LimitsError(
            f"{source} is no TOML: {error}.", hint=f"mend that line; {HELP}."
        ) from error
    except ValidationError as error:
        raise LimitsError(
            f"{source} cannot be used: {'; '.join(_faults(error))}.",
            hint=f"mend these keys; {HELP}.",
        ) from error
    if not (limits.of_windows or limits.of_verdict):
        raise LimitsError(
            f"{source} holds no limit, and a gate without one would hold always.",
            hint=f"add one, such as `loss_of_hold = 0.5` in [simulation] ({HELP}), or let "
            "`shiplog gate RUN --limits FILE --write` write a new file.",
        )
    return limits


def check_names(
    limits: Limits, source: str, causes: Sequence[Cause], actuators: Iterable[str]
) -> None:
    """Raises LimitsError for a cause, or a number of one, that there is not.

    causes     of the user's own, in addition to the catalogue
    actuators  of the ship: a cause of one unit is `thrust_loss:port`
    """
    units = tuple(actuators)
    try:
        of = limits.diagnosis
        for name in (*(of.causes_allowed or ()), *(of.causes_not_allowed or ())):
            check_cause(name, causes, units)
        for name, sizes in limits.sizes.items():
            for parameter in sizes:
                check_size(name, parameter, causes, units)
    except ShiplogError as error:
        raise LimitsError(f"{source}: {error.message}", hint=error.hint) from error


def check_window(limits: Limits, source: str, run: str, window: int) -> None:
    """Raises LimitsError where the run has windows of another length: L and the errors at the end
    grow with it."""
    if limits.of_windows and window != limits.window_s:
        raise LimitsError(
            f"{source} has limits for windows of {limits.window_s} s, and {run} has windows of "
            f"{window} s.",
            hint=f"give limits for {window} s, and put `window_s = {window}` on the first line.",
        )


def refuse_other_voyages(source: str, patterns: Iterable[str], names: Sequence[str]) -> None:
    """Raises LimitsError for sections [voyages.NAME] that fit none of the tested voyages."""
    if patterns := list(patterns):
        several = "sections" if len(patterns) > 1 else "a section"
        raise LimitsError(
            f"{source} has {several} [voyages] of {one_line(listed(patterns))}, and the tested "
            f"voyages are {listed(names)}{nearest(patterns[0], names)}.",
            hint="correct the name, or choose that voyage with --voyages.",
        )


def refuse_replaced(path: Path, **outputs: Path | None) -> None:
    """Raises LimitsError where an output would replace the limits. outputs: option → file."""
    for option, other in outputs.items():
        if other is not None and other.exists() and path.exists() and path.samefile(other):
            raise LimitsError(
                f"--{option} {other} would replace the limits.", hint="give it another file."
            )


def _text(path: Path) -> str:
    if path.is_dir() or not path.exists():  # it may be a pipe
        raise LimitsError(
            f"{path} is a folder, not a file." if path.is_dir() else f"{path} does not exist.",
            hint="give --limits a TOML file, or write one from today's results with --write.",
        )
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise LimitsError(
            f"{path} cannot be read: {error}.",
            hint="save it as UTF-8 text, in a file that you may read.",
        ) from error


def _faults(error: ValidationError) -> list[str]:
    """Pydantic's findings in a user's words, with the nearest known key for an unknown one."""
    found = []
    for item in error.errors():
        place = ".".join(map(str, item["loc"])) or "it"
        if item["type"] == "extra_forbidden":
            key, known = str(item["loc"][-1]), _keys_at(item["loc"][:-1])
            if section := _section_of(key, item["loc"][:-1]):
                found.append(f"{place} belongs into the section [{section}]")
                continue
            close = nearest(key, known)
            found.append(f"{place} is not a known key{close or f' (known: {listed(known)})'}")
        elif item["type"] == "literal_error":
            found.append(
                f"{place}: {item['input']!r} is no verdict{nearest(str(item['input']), VERDICTS)}; "
                f"verdicts are {', '.join(VERDICTS)}"
            )
        elif item["type"] == "less_than_equal":
            found.append(f"{place} has to be a share, from 0 to 1")
        elif item["type"] == "greater_than":
            found.append(f"{place} has to be above 0")
        elif item["type"] in ("model_type", "dict_type"):
            found.append(f"{place} has to be a section of keys")
        elif item["type"] == "tuple_type":
            found.append(f"{place} has to be a list of texts")
        elif item["type"] == "too_short":
            found.append(f"{place} is empty")
        else:
            words = item["msg"].replace("Input should be", "has to be")
            found.append(f"{place} {MESSAGES.get(item['type'], words)}")
    return [one_line(one) for one in dict.fromkeys(found)]


def _keys_at(location: tuple) -> list[str]:
    if not location:
        return list(Limits.model_fields)
    section = {"band": Band, "diagnosis": Diagnosis}.get(str(location[0]), Simulation)
    return list(section.model_fields)


def _section_of(key: str, location: tuple) -> str:
    """The section that a key belongs into, which stands elsewhere; empty for an unknown one."""
    sections = {"simulation": Simulation, "band": Band, "diagnosis": Diagnosis}
    return next(
        (n for n, one in sections.items() if key in one.model_fields and (n,) != location), ""
    )
