"""The pilot card and the wheelhouse poster of IMO A.601(15), appendices 1 and 2, as pages.

What neither the profile nor a model or a log has is left to be filled in aboard. What a model alone
has sailed says so: the resolution wants measured values where there are some.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib.metadata import version

from shiplog.manoeuvres.entry import Entry
from shiplog.manoeuvres.sheet import Sheet
from shiplog.nomenclature.numbers import figure
from shiplog.report.manoeuvres import drawing
from shiplog.report.manoeuvres.sheet import value
from shiplog.report.page.blocks import (
    Block,
    Gallery,
    Grid,
    Items,
    Line,
    Page,
    Paragraph,
    Section,
    number,
)

OPEN = "________"  # to be filled in aboard
KNOT = 0.514444  # m/s
ORDERS = ("full ahead", "half ahead", "slow ahead", "dead slow ahead")
# The sentence that the resolution asks for on the poster.
WARNING = (
    "Performance may differ from this record due to environmental, hull and loading conditions."
)
CHECKS = (
    "anchors", "whistle", "radars", "speed log, through water and over ground",
    "steering gear and its power units", "rudder and revolution indicators", "compasses",
    "rate of turn indicator", "position fixing", "engine telegraphs", "VHF",
)  # fmt: skip


def pilot_card(sheet: Sheet) -> Page:
    return _page(
        sheet, "Pilot card",
        "Particulars and equipment; fill in draughts and what is open before the pilot boards.",
        [
            Section("particulars", "Ship's particulars", [_particulars(sheet)]),
            Section("engine", "Engine and propellers", _engine(sheet)),
            Section("steering", "Steering", [_steering(sheet)]),
            Section("checks", "Checked if aboard and ready", [
                Items([[f"☐ {one}"] for one in CHECKS])
            ]),
            Section("today", "Today", [Items([
                [f"draught forward {OPEN} m, aft {OPEN} m"], [f"displacement {OPEN} t"],
                [f"equipment with defects {OPEN}"], [f"date {OPEN}, signed {OPEN}"],
            ])]),
        ],
    )  # fmt: skip


def poster(sheet: Sheet) -> Page:
    return _page(
        sheet, "Wheelhouse poster", WARNING,
        [
            Section("turning", "Turning circles", _turning(sheet)),
            Section("zigzags", "Checking a turn", _quantities(sheet, "zigzag")),
            Section("stopping", "Stopping", _quantities(sheet, "stop")),
            Section("stability", "Course stability", _quantities(sheet, "pull_out")),
            Section("particulars", "Ship's particulars", [_particulars(sheet)]),
            Section("engine", "Engine and propellers", _engine(sheet)),
            Section("steering", "Steering", [_steering(sheet)]),
            Section("notes", "Notes", [Items([[note] for note in sheet.notes]), Paragraph([
                "Shallow water, ballast and the rescue of a person overboard are not simulated: "
                "add what the ship's trials have."
            ])]),
        ],
    )  # fmt: skip


def _page(sheet: Sheet, what: str, claim: str, sections: Sequence[Section]) -> Page:
    ship = sheet.profile.ship
    return Page(
        title=f"{ship.name}: {what.lower()}",
        kicker=f"{ship.name} · IMO A.601(15) · shiplog {version('shiplog')}",
        word=what, tone="open", claim=claim, sections=sections,
    )  # fmt: skip


def _particulars(sheet: Sheet) -> Block:
    ship, scale = sheet.profile.ship, sheet.scale

    def length(value: float | None) -> Line:
        return [OPEN] if value is None else [number(value * scale, "m", 4)]

    mass: Line = [OPEN] if ship.mass_kg is None else [number(ship.mass_kg * scale**3 / 1e3, "t", 4)]
    block: Line = [OPEN] if ship.block_coefficient is None else [number(ship.block_coefficient)]
    rows = [
        (["name"], [ship.name]), (["length between perpendiculars"], length(ship.length_m)),
        (["breadth"], length(ship.breadth_m)), (["draught of this sheet"], length(ship.draught_m)),
        (["displacement of this sheet"], mass), (["block coefficient"], block),
        (["call sign, year built, IMO number"], [OPEN]), (["air draught"], [OPEN]),
    ]  # fmt: skip
    return Grid(("particular", "value"), rows, ("value",))


def _engine(sheet: Sheet) -> list[Block]:
    """Speeds at which the model goes straight, and what its propellers need for them."""
    actuators = sheet.profile.actuators
    driven = [i for i, a in enumerate(actuators) if a.kind in ("propeller", "thruster")]
    rate, fast = 60.0 / sheet.scale**0.5, sheet.scale**0.5
    rows = []
    for order, (speed, values) in zip(ORDERS, sheet.engine, strict=False):
        turns = [
            [figure(values[i] * rate, 3), " rpm"] if actuators[i].si_unit == "rev/s"
            else [figure(values[i], 3)]
            for i in driven
        ]  # fmt: skip
        rows.append(([order], *turns, [number(speed * fast / KNOT, "kn")], [OPEN]))
    if not rows:
        return [Paragraph(["No model was given: no table of speeds."])]
    titles = ("order", *(actuators[i].name for i in driven), "speed of this sheet",
              "speed in ballast")  # fmt: skip
    return [Grid(titles, rows, titles[1:]), Paragraph([
        "By the model, in calm and deep water. Full ahead is the nominal speed of its voyages."
    ])]  # fmt: skip


def _steering(sheet: Sheet) -> Block:
    rows = []
    for one in sheet.profile.actuators:
        if one.kind not in ("rudder", "azimuth"):
            continue
        limits = one.si_limits
        most = OPEN if limits is None else f"{max(abs(x) for x in limits) * 57.29578:.0f} deg"
        rows.append(([one.name], [one.kind], [most], [OPEN]))
    titles = ("name", "type", "most angle", "hard over to hard over")
    return Grid(titles, rows or [(["none"], ["-"], ["-"], ["-"])], titles[2:])


def _of_kind(sheet: Sheet, kind: str) -> list[Entry]:
    return [e for e in sheet.entries if e.kind == kind and e.lines]


def _best(sheet: Sheet, kind: str) -> list[Entry]:
    """Those that were sailed and are of the standard; for each that was not, the model's."""
    found = _of_kind(sheet, kind)
    sailed = [e for e in found if e.voyage is not None and e.standard]

    def like(one: Entry) -> tuple[int, int, float]:
        return round(math.degrees(one.angle)), round(math.degrees(one.heading)), one.side

    there = {like(one) for one in sailed}
    return [*sailed, *(e for e in found if e.voyage is None and like(e) not in there)]


def _turning(sheet: Sheet) -> list[Block]:
    entries = _best(sheet, "turn")
    pictures = [p for i, e in enumerate(entries[:4], 1) if (p := drawing.picture(e, f"turn-{i}"))]
    return [*([Gallery(pictures)] if pictures else []), *_quantities(sheet, "turn")]


def _quantities(sheet: Sheet, kind: str) -> list[Block]:
    entries = _best(sheet, kind)
    if not entries:
        return [Paragraph(["Neither measured nor simulated."])]
    rows = []
    for entry in entries:
        source = "simulated" if entry.voyage is None else "measured"
        for line in entry.lines:
            best = line.measured or line.extended or line.simulated
            unit = "" if line.kind.unit == "1" else f" {line.kind.unit}"
            rows.append(([entry.name], [line.kind.words], [f"{value(best)}{unit}"], [source]))
    return [Grid(("manoeuvre", "quantity", "value", "source"), rows, ("value",))]
