"""A model sailed on a schedule, as a command prints and writes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.exceptions import ShiplogError
from shiplog.logs.conversion.write import Series, write_log
from shiplog.machine import files
from shiplog.manoeuvres.quantity import QUANTITIES, Estimate
from shiplog.nomenclature.channels import STATE
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted, figure
from shiplog.nomenclature.units import SECOND_NS
from shiplog.report.evaluation.text_table import table
from shiplog.report.manoeuvres.sheet import value
from shiplog.report.result import Printed
from shiplog.ship_profile.profile import Actuator, Profile
from shiplog.simulation.sailing import Sailed
from shiplog.training.runs.sailing_run import Outside

# A log needs a date, and a simulation has none: the first day that its readers take for one.
BEGINS_NS = 946_684_800 * SECOND_NS  # 2000-01-01 UTC
ENDINGS = {
    ".parquet": "every member", ".csv": "every member", ".mcap": "the model as it stands, as a log",
    ".rrd": "a recording",
}  # fmt: skip
SCHEMAS = {
    "rudder": ("shiplog.Rudder", "angle_deg"), "azimuth": ("shiplog.Azimuth", "angle_deg"),
    "propeller": ("shiplog.Propeller", "speed_rps"), "thruster": ("shiplog.Thruster", "command"),
}  # fmt: skip


@dataclass(frozen=True, repr=False)
class Simulation(Printed):
    """`frame` is a row an instant of each member, SI; member 0 is the model as it stands. `band`
    has its states with `_low` and `_high`, the middle 90 % of the members.

    quantities  of the manoeuvre, with their intervals
    """

    run: str
    name: str
    kind: str
    profile: Profile
    sailed: Sailed
    outside: Outside
    quantities: Mapping[str, Estimate]
    notes: tuple[str, ...] = ()
    saved: Path | None = None

    @property
    def frame(self) -> pl.DataFrame:
        return self.sailed.frame

    @property
    def band(self) -> pl.DataFrame:
        low, high = self.sailed.band()
        columns = {"time": self.sailed.time}
        for i, c in enumerate(STATE):
            columns[c.name] = self.sailed.state[0, :, i]
            columns[f"{c.name}_low"], columns[f"{c.name}_high"] = low[:, i], high[:, i]
        columns |= {n: self.sailed.actuator[0, :, i] for i, n in enumerate(self.sailed.names)}
        return pl.DataFrame(columns).filter(pl.col("x0").is_finite()).fill_nan(None)

    @property
    def ended(self) -> float | None:
        """s at which the model as it stands had completed the manoeuvre; None where it had not."""
        end = float(self.sailed.ended[0])
        return end if np.isfinite(end) else None

    @property
    def diverged(self) -> float | None:
        at = float(self.sailed.diverged[0])
        return at if np.isfinite(at) else None

    @property
    def lines(self) -> list[str]:
        count, last = len(self.sailed), self.band["time"].max()
        many = f", with {counted(count - 1, 'draw')} of what it may be" if count > 1 else ""
        found = [f"{self.run} sails {self.name}: {figure(float(last or 0.0), 3)} s{many}."]  # type: ignore[arg-type]
        if self.diverged is not None:
            found.append(
                f"It diverges after {self.diverged:.0f} s: what it says of longer times is nothing."
            )
        elif self.ended is None and self.kind != "schedule":
            found.append("It did not complete the manoeuvre in that time.")
        lost = int(np.isfinite(self.sailed.diverged[1:]).sum())
        if lost and self.diverged is None:
            found.append(f"{lost} of its {counted(count - 1, 'draw')} diverge.")
        if self.outside.sentence:
            found.append(f"It is {self.outside.sentence}: marked with a star.")
        if self.quantities:
            rows = [
                (QUANTITIES[n].words, QUANTITIES[n].unit, value(e))
                for n, e in self.quantities.items()
            ]
            found += ["", table(("quantity", "unit", "value (90 %)"), rows, ("value (90 %)",))]
        found += ["", *self.notes] if self.notes else []
        return [*found, "", f"Written: {self.saved}"] if self.saved else found

    @property
    def json(self) -> dict:
        return {
            "contract": CONTRACT, "run": self.run, "manoeuvre": self.name, "kind": self.kind,
            "members": len(self.sailed), "ended_s": self.ended, "diverged_s": self.diverged,
            "diverged": float(np.isfinite(self.sailed.diverged).mean()),
            "outside": {"share": self.outside.share, "channels": dict(self.outside.channels)},
            "quantities": [
                {"name": n, "unit": QUANTITIES[n].unit, **e.json}
                for n, e in self.quantities.items()
            ],
            "notes": list(self.notes), "saved": None if self.saved is None else str(self.saved),
        }  # fmt: skip


def check(path: Path) -> None:
    """Raises ShiplogError for an ending that nothing is written as, before the work."""
    if path.suffix.lower() not in ENDINGS:
        raise ShiplogError(
            f"--out {path} has an ending of no kind of file that a simulation is written as.",
            hint="end its name in "
            f"{', '.join(f'{ending} ({what})' for ending, what in ENDINGS.items())}.",
        )


def write(found: Simulation, path: Path) -> None:
    """Whole or not at all. Raises ShiplogError where the file cannot be written."""
    check(path)
    ending = path.suffix.lower()
    try:
        if ending == ".parquet":
            files.write_frame(path, found.frame)
        elif ending == ".csv":
            with files.whole(path) as partial:
                found.frame.write_csv(partial)
        elif ending == ".mcap":
            write_log(path, series(found), ship=found.profile.ship.name, notes={"model": found.run})
        else:
            from shiplog.report.viewer import sailed

            sailed.write(found.band, f"{found.run}: {found.name}", found.profile, path)
    except OSError as error:
        raise ShiplogError(
            f"{path} could not be written: {error.strerror or error}.",
            hint="is the disk full, is the folder writable?",
        ) from error


def series(found: Simulation) -> list[Series]:
    """The model as it stands as the contract's topics: `/sim/<model>/state` and its actuators."""
    rows = found.band
    time = BEGINS_NS + np.round(rows["time"].to_numpy() * 1e9).astype(np.int64)
    degrees = 180.0 / np.pi
    state = Series(
        f"/sim/{found.run}/state", "shiplog.ShipState", time,
        {
            "x0_m": rows["x0"].to_numpy(), "y0_m": rows["y0"].to_numpy(),
            "heading_deg": rows["heading"].to_numpy() * degrees % 360.0,
            "surge_mps": rows["surge"].to_numpy(), "sway_mps": rows["sway"].to_numpy(),
            "yaw_rate_degps": rows["yaw_rate"].to_numpy() * degrees,
        },
    )  # fmt: skip
    return [state, *(_actuator(one, rows, time) for one in found.profile.actuators)]


def _actuator(one: Actuator, rows: pl.DataFrame, time: np.ndarray) -> Series:
    schema, column = SCHEMAS[one.kind]
    values = rows[one.name].to_numpy()
    if one.kind in ("rudder", "azimuth"):
        values = np.degrees(values)
    return Series(f"/{one.kind}/{one.name}", schema, time, {column: values})
