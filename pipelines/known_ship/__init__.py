"""A ship whose truth is known: published physics, an operator, weather, instruments, and effects
that can be hidden. It shares no code with `shiplog` but the log writer."""

from pipelines.known_ship.laws import Laws
from pipelines.known_ship.sample_logs import write_sample_logs
from pipelines.known_ship.sensors import Blemishes, write_voyage
from pipelines.known_ship.ship import BANK_EAST, LIMITS, Effects, Ship, varied
from pipelines.known_ship.voyage import Voyage, sail
from pipelines.known_ship.weather import CALM, Wind

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
