"""The particle filter by the field on small robots, for its tests."""

import numpy as np

from rfiddesign.estimators import particle_filter
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.geometry import Disc, listed
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.recording import Reads
from rfiddesign.models.robot import Robot
from rfiddesign.numerics._noise_kernels import run_key

DT = 0.05
QUIET = OmnidirectionalMotion(0.0, 0.0, 0.0)
LAYOUT = listed([(150.0, 0.0, 0.0), (0.0, -200.0, 0.8)])
CENTRED = listed([(0.0, 0.0, 0.0)])
RADII = (60.0, 45.0, 30.0)
RADIUS = 30.0


def key_of(repetition):
    return np.uint64(run_key(np.uint64(80), np.uint64(repetition)))


KEY = key_of(0)


def built(layout, area=None, radii=(), reads=None, **settings):
    """A filter without motion noise unless said."""
    robot = Robot(layout, area or Disc(radii[0] if radii else RADIUS), radii, reads or ReadModel())
    return particle_filter.build(ParticleFilter(**({"motion": QUIET} | settings)), robot, DT)


def particles_of(ready, state):
    """(M, 3) poses."""
    return np.column_stack([particle_filter.positions(ready, state).T, particle_filter.headings(ready, state)])


def read_by(antenna, tag, rssi=-1):
    return Reads(np.array([antenna]), np.array([tag], float), np.array([rssi]))
