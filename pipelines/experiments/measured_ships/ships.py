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
