"""How things look: one colour per model, dark for what was measured, and light backgrounds."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from shiplog.report.viewer.comparison_data import TIMELINE

Colour = tuple[int, int, int, int]

MEASURED: Colour = (25, 25, 25, 255)
MODEL_COLOURS: tuple[Colour, ...] = (  # Okabe and Ito: colour-blind readers can distinguish them
    (0, 114, 178, 255), (213, 94, 0, 255), (0, 158, 115, 255), (204, 121, 167, 255),
    (230, 159, 0, 255), (86, 180, 233, 255), (120, 80, 40, 255), (150, 150, 0, 255),
)  # fmt: skip
ACTUATOR_COLOURS = MODEL_COLOURS  # never in one view with a model
FORCE_COLOURS: dict[str, Colour] = {  # of the force on the ship; total dark, as what is measured
    "hull": MODEL_COLOURS[0], "propeller": MODEL_COLOURS[1], "rudder": MODEL_COLOURS[2],
    "wind": MODEL_COLOURS[5], "thruster": MODEL_COLOURS[4], "network": MODEL_COLOURS[3],
    "total": MEASURED,
}  # fmt: skip
OTHER_PARTS = (MODEL_COLOURS[6], MODEL_COLOURS[7])
TRAINING: Colour = (150, 160, 175, 255)
TEST: Colour = (213, 94, 0, 255)
GRID: Colour = (222, 226, 230, 255)
ZERO: Colour = (190, 196, 202, 255)
BANK: Colour = (140, 110, 70, 255)
TICK: Colour = (30, 30, 30, 255)
PAPER: Colour = (250, 250, 250, 255)


def colours(models: list[str]) -> dict[str, Colour]:
    """A fixed colour for every model, in the order they were given."""
    return {model: MODEL_COLOURS[i % len(MODEL_COLOURS)] for i, model in enumerate(models)}


def part_colours(parts: list[str]) -> dict[str, Colour]:
    """A part's own colour wherever it is drawn; parts without one share the other colours."""
    others = sorted(part for part in parts if part not in FORCE_COLOURS)
    spare = {part: OTHER_PARTS[i % len(OTHER_PARTS)] for i, part in enumerate(others)}
    return {part: FORCE_COLOURS.get(part) or spare[part] for part in parts}


def faded(colour: Colour, share: float = 0.35) -> Colour:
    """The same colour mixed into the paper, for what stands behind: Rerun's lines are opaque."""
    red, green, blue = (
        round(share * c + (1.0 - share) * p) for c, p in zip(colour[:3], PAPER[:3], strict=True)
    )
    return (red, green, blue, 255)


def instants(seconds: np.ndarray) -> rr.TimeColumn:
    """Seconds [n] as the recording's time, to the nearest nanosecond.

    Rerun 0.41 cuts what is below a nanosecond off an array of seconds: one instant of forty at
    10 Hz is then 1 ns early, and is no instant of what was logged by another call.
    """
    whole = np.rint(np.asarray(seconds, np.float64) * 1e9).astype("timedelta64[ns]")
    return rr.TimeColumn(TIMELINE, duration=whole)


def entity(*parts: str) -> str:
    """An entity path: names of voyages and models keep their spaces and slashes, escaped."""
    return rr.new_entity_path(list(parts))


def plot_background() -> rrb.archetypes.PlotBackground:
    return rrb.archetypes.PlotBackground(color=PAPER, show_grid=False)
