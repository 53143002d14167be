"""The data sets: what their owners would type."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class DataSet:
    """One ship's data, in a folder of the collection.

    tables    patterns of what `convert` takes; else `logs`, patterns of MCAP files
    profile   a shipped one's name, or a file of the folder; None: drafted from the first file
    mended    what the owner changes in the draft: old text → new text
    vessel    which ship of a table that holds several
    train     more arguments of `train`
    trial     patterns of the voyages in question; none: the split's test voyages
    """

    ship: str
    folder: str
    tables: tuple[str, ...] = ()
    logs: tuple[str, ...] = ()
    profile: str | None = None
    mended: Mapping[str, str] = field(default_factory=dict)
    vessel: str | None = None
    train: tuple[str, ...] = ()
    trial: tuple[str, ...] = ()

    @property
    def in_sample(self) -> bool:
        """The voyages in question hold those that a baseline is fitted to."""
        return "*" in self.trial


HEADING = """[sensors.heading]
topic = "/gyro"
field = "heading_deg"
unit = "deg"
"""

# CyberShip Enterprise I: what `cybership` found of its rows. The places are estimates, which do not
# come with the data; the two propellers are abaft midship, the bow thruster ahead of it.
CSE_PLACES = {  # actuator: row, ahead and to starboard of midship [m], direction [deg]
    "port_ahead": (8, -0.46, -0.055, 0.0), "port_athwart": (9, -0.46, -0.055, 90.0),
    "starboard_ahead": (10, -0.46, 0.055, 0.0), "starboard_athwart": (11, -0.46, 0.055, 90.0),
    "bow": (12, 0.39, 0.0, 90.0),
}  # fmt: skip
CSE_POSE = """[sensors.position]
kind = "local"
topic = "/ship/state"
fields = ["x0_m", "y0_m"]
unit = "m"
"""
CSE_ACTUATOR = """[[actuators]]
name = "{name}"
kind = "thruster"
topic = "/thruster/{name}"
field = "command"
unit = "1"
limits = [-1.01, 1.01]
position_m = [{ahead}, {starboard}]
direction_deg = {direction}

"""
CSE_TABLE = """[table]
"cse1_data_1" = { channel = "time", unit = "s" }
"cse1_data_2" = { channel = "x0", unit = "m" }
"cse1_data_3" = { channel = "y0", unit = "m" }
"cse1_data_7" = { channel = "heading", unit = "rad" }
"""


def _cse() -> dict[str, str]:
    """What the owner of a matrix without names fills in."""
    driven = "".join(
        CSE_ACTUATOR.format(name=name, ahead=ahead, starboard=starboard, direction=direction)
        for name, (_, ahead, starboard, direction) in CSE_PLACES.items()
    )
    columns = "".join(
        f'"cse1_data_{row}" = {{ channel = "{name}" }}\n' for name, (row, *_) in CSE_PLACES.items()
    )
    return {
        "length_m = 1.0": "length_m = 1.1",
        "# breadth_m = 0.0": "breadth_m = 0.25",
        "# mass_kg = 0.0": "mass_kg = 14.8",
        "# No position was recognised, and shiplog needs one.": CSE_POSE,
        "# No heading was recognised, and shiplog needs one.": HEADING,
        "# No actuator was recognised": f"{driven}# No other actuator was recognised",
        "[table]\n": CSE_TABLE + columns,
    }


# The Dalian boat: nothing says how long it is, nor how far apart its two thrusters are.
THRUSTER = """topic = "/thruster/pwm_{side}"
field = "command"
unit = "pwm"
offset = 1500.0  # CHECK: the neutral pulse
"""

DATA_SETS: dict[str, DataSet] = {
    "esso-osaka": DataSet(
        "Esso Osaka, 3 m model, pond",
        "frt-ds-esso",
        tables=("random/*", "turning/*", "zigzag/*", "berthing/*"),
        profile="esso-osaka",
    ),
    "esso-osaka, published": DataSet(
        "Esso Osaka, published coefficients",
        "frt-ds-esso",
        tables=("random/*", "turning/*", "zigzag/*", "berthing/*"),
        profile="esso-osaka",
        train=("--no-fit",),
        trial=("*",),
    ),
    "kvlcc2": DataSet(
        "KVLCC2, 7 m model, HSVA",
        "kvlcc2_simman",
        tables=("hsva_cpmc_zigzag_20hz_model.parquet",),
        profile="kvlcc2",
        train=("--window", "50"),
    ),
    "kvlcc2, full scale": DataSet(
        "KVLCC2, MARIN, scaled up",
        "kvlcc2_simman",
        tables=("marin_free_fullscale.parquet",),
        profile="kvlcc2-full-scale",
    ),
    "blueboat": DataSet(
        "BlueBoat, 1.2 m, fjord",
        "blueboat_ntnu",
        tables=("blueboat_10hz.parquet",),
        profile="blueboat",
        train=("--window", "20"),
    ),
    "milliampere": DataSet(
        "milliAmpere, 5 m ferry",
        "milliampere1_physical",
        tables=("maneuvering1", "nlp1", "qp1"),
        profile="milliampere",
        train=("--window", "50"),
    ),
    "other_ship": DataSet(
        "3 m ship of another simulator",
        "other_ship",
        logs=("*.mcap",),
        profile="other_ship.toml",
        train=("--voyages", "nominal_*"),
        trial=("trial_*",),
    ),
    "usv_fuzhou": DataSet(
        "USV, 3.6 m, 2 Hz",
        "usv_fuzhou",
        tables=("usv_2hz.parquet",),
        mended={
            "length_m = 1.0": "length_m = 3.6",
        },
        train=("--window", "15", "--unchecked"),
    ),
    "qixing": DataSet(
        "USV, Qixing bay, no actuators",
        "qixing_usv_drift",
        tables=("usv_nmea_5hz.parquet",),
    ),
    "tycho-brahe": DataSet(
        "Tycho Brahe, ferry, 1 Hz",
        "oresund_ferries",
        tables=("ferries_1hz.parquet",),
        vessel="tycho-brahe",
        mended={
            "length_m = 1.0": "length_m = 111.2",
            "# No heading was recognised, and shiplog needs one.": HEADING,
            "[table]": '[table]\n"Stävad kurs (deg)" = { channel = "heading", unit = "deg" }',
        },
    ),
    "aurora": DataSet(
        "Aurora, ferry, 1 Hz, no heading",
        "oresund_ferries",
        tables=("ferries_1hz.parquet",),
        vessel="aurora",
    ),
    "hakusan": DataSet(
        "Hakusan, container ship, 1 Hz",
        "hakusan",
        tables=("hakusan_1hz.parquet",),
    ),
    "cybership": DataSet(
        "CyberShip Enterprise I, pose only",
        "cybership_enterprise1",
        tables=("CSE1_data_random_run1.mat", "CSE1_data_random_run3.mat"),
        mended=_cse(),
        train=("--window", "20", "--unchecked", "--voyages", "*_run1"),
        trial=("*_run3",),
    ),
    "dalian": DataSet(
        "USV of Dalian, Excel, circles",
        "dalian_usv",
        tables=("*.xlsx",),
        mended={
            **{
                THRUSTER.format(
                    side=one
                ): f"{THRUSTER.format(side=one)}position_m = [-0.4, {at}]\n# "
                for one, at in (("l", -0.2), ("r", 0.2))
            },
            # what `ingest` says of the draft's guess, once the thrusters have places
            'unit = "pwm", sign = -1, offset': 'unit = "pwm", offset',
        },
        train=("--window", "20", "--unchecked"),
    ),
    "aava": DataSet(
        "Sailing yacht, NMEA 2000",
        "signalk_samples",
        logs=("aava-n2k.data",),
        mended={"length_m = 1.0": "length_m = 12.0"},
    ),
    "merrimac": DataSet(
        "Yacht at its berth, GoFree",
        "signalk_samples",
        logs=("gofree-merrimac.log",),
        mended={"length_m = 1.0": "length_m = 12.0"},
    ),
    "mcap, location": DataSet(
        "GNSS and sensors, JSON",
        "mcap",
        logs=("json/t2m_location_sensor.mcap",),
    ),
    "mcap, battery": DataSet(
        "battery, speed, location",
        "mcap",
        logs=("json/foxglove_tutorial_battery_speed_location.mcap",),
    ),
    "mcap, AIS": DataSet(
        "Baltic AIS, 637 ships",
        "mcap",
        logs=("protobuf/keelson_sjofartsverket_ais.mcap",),
        vessel="230980670",
    ),
}
