"""A ship whose truth is known: published physics, an operator, weather, instruments, and effects
that can be hidden. It shares no code with `shiplog` but the log writer."""

from pipelines.experiments.simulated_ship.laws import Laws
from pipelines.experiments.simulated_ship.sample_logs import write_sample_logs
from pipelines.experiments.simulated_ship.sensors import Blemishes, write_voyage
from pipelines.experiments.simulated_ship.ship import BANK_EAST, LIMITS, Effects, Ship, varied
from pipelines.experiments.simulated_ship.voyage import Voyage, sail
from pipelines.experiments.simulated_ship.weather import CALM, Wind

__all__ = [
    "BANK_EAST",
    "CALM",
    "LIMITS",
    "Blemishes",
    "Effects",
    "Laws",
    "Ship",
    "Voyage",
    "Wind",
    "sail",
    "varied",
    "write_sample_logs",
    "write_voyage",
]
