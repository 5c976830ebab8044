"""Every estimator by its settings: the module that offers `build`, `init`, `flops_per_step` and the verbs."""

from typing import Any, Protocol

from rfiddesign.estimators import ekf, geometric, histogram, markov, mcl, particle_filter, pmg
from rfiddesign.estimators.operations import Load
from rfiddesign.estimators.start import Start
from rfiddesign.estimators.verbs import Belief, Filter
from rfiddesign.models.motion import Motion
from rfiddesign.models.robot import Robot


class Settings(Protocol):
    """What the settings of every estimator have."""

    motion: Motion


_MODULES: dict[type, Any] = {
    ekf.Ekf: ekf,
    geometric.Geometric: geometric,
    markov.Markov: markov,
    histogram.Histogram: histogram,
    mcl.Mcl: mcl,
    particle_filter.ParticleFilter: particle_filter,
    pmg.Pmg: pmg,
}


def build(settings: Settings, robot: Robot, dt_s: float) -> Filter:
    """Make an estimator ready for a robot that is heard every `dt_s` seconds."""
    return _MODULES[type(settings)].build(settings, robot, dt_s)


def init(ready: Filter, start: Start, key: int) -> Belief:
    """The belief before the first step; `key` names the run's random streams."""
    return _MODULES[type(ready.settings)].init(ready, start, key)


def flops_per_step(ready: Filter, load: Load) -> float:
    """Floating-point operations of a step under that load, about; see `operations`."""
    return _MODULES[type(ready.settings)].flops_per_step(ready, load)
