"""The work that is timed: a robot on a floor, its recording, its filter."""

from dataclasses import dataclass

import numpy as np

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators import mcl
from rfiddesign.estimators.start import KnownStart
from rfiddesign.estimators.verbs import Filter
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.models.recording import Recording
from rfiddesign.models.robot import Robot
from rfiddesign.simulation import Scenario
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of, true_poses

FLOOR = rectangle_floor(12_000, 10_000, footprint_radius_mm=320)


@dataclass(frozen=True)
class Scene:
    """A design in a scenario, with one recording of it."""

    design: Design
    scenario: Scenario
    poses: np.ndarray
    recording: Recording
    ready: Filter
    run: int

    @property
    def n_particles(self) -> int:
        return self.ready.settings.n_particles

    @property
    def reads_per_step(self) -> float:
        return self.recording.n_reads / self.recording.n_steps

    def track(self):
        """Our filter over the whole recording."""
        n, key = self.recording.n_steps, key_of(1, self.run)
        estimates = np.empty((n + 1, mcl.N_ESTIMATE))
        mcl.track(self.ready, mcl.init(self.ready, KnownStart(tuple(self.poses[0])), key), self.recording, n, estimates)
        return estimates


def make_scene(layout="cross-8", antenna_name="60x60", tags_per_m2=115.0, n_particles=512, duration_s=50.0, run=0):
    """A known start on a hall of 12 x 10 m; 1,000 steps unless said."""
    settings = mcl.Mcl(n_particles=n_particles)
    scenario = Scenario(FLOOR, estimator=settings, duration_s=duration_s)
    design = Design(make_layout(layout), antenna(antenna_name), make_pattern("square", tags_per_m2=tags_per_m2))
    tags, poses = build_tag_map(design.pattern.lay(FLOOR.drivable)), true_poses(scenario, 1, run)
    recording = record(design, tags, poses, scenario.dt_s, scenario.world, key_of(1, run))
    ready = mcl.build(settings, Robot.of(design, scenario.world.reads), scenario.dt_s)
    return Scene(design, scenario, poses, recording, ready, run)
