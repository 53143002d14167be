"""What a watch compares with: the nominal campaign of its run, with a short bank of causes.

The model, its coefficients, the process noise and how far parts of a campaign differ are those of
`diagnose`, kept in the same cache. Only the bank is shorter: a watch names a suspect and no cause,
and what needs a map of the place or a pair of actuators is left to the diagnosis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.linear import segments
from shiplog.diagnosis.linear.segments import SegmentGrid
from shiplog.diagnosis.nominal import nominal_cache, nominal_campaign
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.trial import trial_voyages
from shiplog.live import left_out
from shiplog.live.handling import Handling
from shiplog.models import causes as catalogue
from shiplog.models.causes import Setting
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.training.runs.load_model import Run
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.rows.timescale import Timescale
from shiplog.voyages.store.store import Store

# Causes by name that a watch may suspect: one force or one instrument each, of few numbers.
BANK = (
    "current", "wind_force", "fouling", "payload", "cross_flow_drag", "thrust_loss",
    "rudder_force", "rudder_offset", "rudder_lag", "rudder_delay", "heading_offset",
    "yaw_rate_bias", "yaw_rate_scale", "clock_offset", "antenna_offset",
    "wind_direction_offset", "wind_speed_scale",
)  # fmt: skip
LEAST_SEGMENTS = 16  # of the nominal campaign: two parts of eight, fewer of which are no campaign


@dataclass(frozen=True)
class Nominal:
    """A run's nominal campaign: its record, what it says of the model, and how it was sailed."""

    record: Record
    campaign: Campaign
    handling: Handling

    @property
    def grid(self) -> SegmentGrid:
        return segments.grid(self.record)

    def without_segments(self) -> Nominal:
        """What segments of a watch need: no row and no segment of the campaign."""
        none = self.record.pick(())
        return replace(self, record=none, campaign=self.campaign.without_nominal())

    @property
    def timescale(self) -> Timescale:
        return self.record.timescale


def why_none(run: Run, store: Store) -> str:
    """Why there can be no alarm with this run and store; empty where there can."""
    if run.given:
        return "its coefficients were fitted to no voyage, so that no campaign shows its errors"
    if run.extension is not None:
        return "it was extended by a diagnosis; watch with the run that it extends"
    if run.lacks:
        return run.lacks
    if not run.judges_itself:
        return "it is a network, whose errors are not those of the equations that name a suspect"
    if not store.there(run.trained_on):
        return f"the store {store.path} does not hold the voyages that it was trained on"
    return ""


def nominal(run: Run, store: Store) -> Nominal | None:
    """The nominal campaign; None where it is too short. Raises np.linalg.LinAlgError where the
    model diverges on it."""
    scaled = _record(run, store)
    if len(segments.begins(scaled)) < LEAST_SEGMENTS:
        return None
    setting, plain, model, start = _models(run, scaled)
    at = nominal_cache.converged(plain, setting, start, scaled)
    found = nominal_cache.characteristics(plain, setting, start, scaled, at)
    learned = nominal_campaign.learn(model, setting, start, scaled, at, found)
    common = left_out.in_common(learned, scaled.voyage[segments.begins(scaled)])
    return Nominal(scaled, common, Handling.of(scaled))


def is_kept(run: Run, store: Store) -> bool:
    """Whether its fit was made before, and only has to be read."""
    scaled = _record(run, store)
    setting, plain, _, start = _models(run, scaled)
    return nominal_cache.is_kept(plain, setting, start, scaled)


def _models(run: Run, scaled: Record) -> tuple[Setting, Extended, Extended, Start]:
    """The model that is fitted, with all causes that can be tested, and that with the bank."""
    setting = trial_voyages.setting_of(run, scaled, scaled)
    testable, _ = catalogue.testable(setting)
    plain, _ = trial_voyages.model_of(run, testable, setting)
    bank = [cause for cause in testable if cause.name in BANK]
    model, start = trial_voyages.model_of(run, bank, setting)
    return setting, plain, model, nominal_campaign.widen(plain, setting, start)


def _record(run: Run, store: Store) -> Record:
    """The training voyages at 10 Hz, in the ship's time scale."""
    there = store.there(run.trained_on)
    record = trial_voyages.record_of(store, there, store.profile(there))
    scaled, _ = trial_voyages.rescale_time(run, record, record)
    assert scaled is not None
    return scaled


def bank_columns(campaign: Campaign) -> dict[str, np.ndarray]:
    """Label → its columns among the numbers of the campaign."""
    return dict(campaign.reference.columns.indices)


def as_campaign(record: Record, timescale: Timescale) -> Record:
    """A record of the watch in the time scale of the campaign; later than all of it."""
    return replace(record, timescale=timescale, share=np.ones(len(record)))
