"""One colour for one thing, in every picture, page and recording. No drawing library is imported.

Models take Okabe and Ito's colours (2008), which colour-blind readers can distinguish. A run's
colour follows from its name, not from its place in a list: the same run looks the same alone, in
a comparison, in a diagnosis and on a page.
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterable, Sequence

Colour = tuple[int, int, int, int]  # red, green, blue, opacity: 0 to 255

BLUE: Colour = (0, 114, 178, 255)
GREEN: Colour = (0, 158, 115, 255)
PURPLE: Colour = (204, 121, 167, 255)
ORANGE: Colour = (230, 159, 0, 255)
SKY: Colour = (86, 180, 233, 255)
VERMILLION: Colour = (213, 94, 0, 255)

PAPER: Colour = (250, 250, 250, 255)  # the ground of every picture
MEASURED: Colour = (25, 25, 25, 255)
MODELS: tuple[Colour, ...] = (BLUE, GREEN, PURPLE, ORANGE, SKY, (94, 60, 153, 255))
EXTENDED: Colour = VERMILLION  # the model that a diagnosis extended, and no other
NAMED_FORCE: Colour = EXTENDED  # what the extended model has and the one before has not
WIND: Colour = (170, 68, 120, 255)  # arrows and forces
CURRENT: Colour = (100, 90, 210, 255)
BANK: Colour = (140, 110, 70, 255)
GRID: Colour = (222, 226, 230, 255)
ZERO: Colour = (190, 196, 202, 255)
TEXT: Colour = (30, 30, 30, 255)
TRAINING: Colour = (150, 160, 175, 255)  # what a model was trained on, next to the trial
TRIAL: Colour = (90, 90, 90, 255)
# No hue of a model, which would look like that model's. Legends lie on a dark ground or on a light
# one, as the reader's viewer is set: each of these has a contrast of 3 with either.
ACTUATORS: tuple[Colour, ...] = (
    (150, 105, 55, 255), (85, 115, 155, 255), (120, 120, 120, 255), (165, 90, 90, 255),
    (100, 125, 70, 255), (140, 100, 150, 255), (165, 120, 30, 255), (60, 130, 130, 255),
)  # fmt: skip
FORCES: dict[str, Colour] = {  # of each part on the ship; the total is dark
    "hull": (85, 115, 155, 255), "propeller": (60, 130, 130, 255), "rudder": (150, 105, 55, 255),
    "wind": WIND, "current": CURRENT, "thruster": (100, 125, 70, 255),
    "network": (120, 120, 120, 255), "total": MEASURED,
}  # fmt: skip
OTHER_FORCES: tuple[Colour, ...] = ((140, 100, 150, 255), (165, 90, 90, 255))
# Names that the demo and the pages use look different in one picture.
PREFERRED: dict[str, Colour] = {
    "mmg": BLUE, "ref": GREEN, "d-ref": PURPLE, "feedforward": GREEN, "hybrid": SKY,
    "sli10": ORANGE, "the model": BLUE, "before": BLUE,
}  # fmt: skip


def colours(models: Sequence[str], extended: Collection[str] = ()) -> dict[str, Colour]:
    """Each model's colour. Of a label "mmg (physics)" the name before the bracket counts.

    extended   those of `models` that a diagnosis extended: the first has EXTENDED

    A name keeps its colour whatever is drawn with it, but for one case: of two names that ask for
    one colour, the later in the alphabet takes the next that is free. Beyond six models some share.
    """
    found: dict[str, Colour] = {}
    in_order = [*sorted(m for m in models if m in extended), *sorted(models)]
    for label in in_order:
        if (colour := _wanted(label, label in extended)) not in found.values():
            found.setdefault(label, colour)
    for label in in_order:
        if label not in found:
            free = [colour for colour in MODELS if colour not in found.values()]
            found[label] = free[0] if free else _wanted(label, False)
    return {model: found[model] for model in models}


def _wanted(label: str, extended: bool) -> Colour:
    name = label.partition(" (")[0]
    if extended:
        return EXTENDED
    number = zlib.crc32(name.encode())  # the same in every process and on every machine
    return PREFERRED.get(name) or MODELS[number % len(MODELS)]


def forces(parts: Iterable[str]) -> dict[str, Colour]:
    """A part's own colour wherever it is drawn; parts without one share the other colours."""
    parts = list(parts)
    others = sorted(part for part in parts if part not in FORCES)
    spare = {part: OTHER_FORCES[i % len(OTHER_FORCES)] for i, part in enumerate(others)}
    return {part: FORCES.get(part) or spare[part] for part in parts}


def faded(colour: Colour, share: float = 0.35) -> Colour:
    """The same colour mixed into the paper, for what stands behind."""
    red, green, blue = (
        round(share * c + (1.0 - share) * p) for c, p in zip(colour[:3], PAPER[:3], strict=True)
    )
    return (red, green, blue, 255)


def web(colour: Colour) -> str:
    """As HTML, SVG and matplotlib take it: "#0072b2"."""
    return "#" + "".join(f"{part:02x}" for part in colour[:3])
