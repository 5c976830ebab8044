"""The particle filter by the field: what it makes of the strength of a read, and of one that contradicts it."""

import math

import numpy as np
import pytest
from scipy import stats

from rfiddesign.estimators import particle_filter
from rfiddesign.estimators.start import KnownStart, UncertainStart, UnknownStart
from rfiddesign.geometry import Disc, Rectangle, compose, listed, to_local
from rfiddesign.models.recording import Reads
from tests.estimators.field_filter import CENTRED, KEY, LAYOUT, RADII, RADIUS, built, particles_of, read_by

# RSSI


@pytest.mark.parametrize("rssi", [0, 1, 2])
def test_rssi_puts_the_tag_into_its_ring(rssi):
    """Between the radii of its step and the next, from a box with any heading; without RSSI anywhere in the disc."""
    tag, box = np.array([30.0, -20.0]), UnknownStart((-150.0, -150.0, 150.0, 150.0))
    for uses_rssi in (True, False):
        ready = built(CENTRED, radii=RADII, uses_rssi=uses_rssi, softness_mm=0.0, n_particles=50_000)
        state = particle_filter.init(ready, box, KEY)
        state = particle_filter.update(ready, state, read_by(0, tag, rssi))
        distance = np.hypot(*(particles_of(ready, state)[:, :2] - tag).T)
        inner, outer = (*RADII, 0.0)[rssi + 1 if uses_rssi else 3], RADII[rssi if uses_rssi else 0]
        # A cell of the table is 1 mm; a thousandth of the weight is left to what cannot be.
        is_in = (distance > inner - 1) & (distance < outer + 1)
        ring = math.pi * (outer**2 - inner**2)
        assert np.mean(is_in) == pytest.approx(ring / (ring + 300**2 * 1e-3 / 0.98), abs=0.01)
        area = np.histogram(distance[is_in], bins=np.sqrt(np.linspace(inner**2, outer**2, 5)))[0]
        assert area.min() / area.max() > 0.8


def test_a_read_without_rssi_of_an_antenna_that_has_it_is_anywhere_in_the_disc():
    ready = built(LAYOUT, radii=RADII, uses_rssi=True, n_particles=5000)
    plain = built(LAYOUT, radii=RADII, uses_rssi=False, n_particles=5000)
    box = UnknownStart((-150.0, -150.0, 150.0, 150.0))
    states = [
        particle_filter.update(f, particle_filter.init(f, box, KEY), read_by(0, (0.0, 0.0))) for f in (ready, plain)
    ]
    assert np.array_equal(particles_of(ready, states[0]), particles_of(plain, states[1]))


# Restart


@pytest.mark.parametrize(
    ("area", "yaw"), [(Disc(RADIUS), 0.3), (Rectangle(120.0, 40.0), 0.7)], ids=lambda v: type(v).__name__
)
def test_particles_that_all_contradict_a_read_restart_in_its_detection_region(area, yaw):
    """The tag anywhere in what the antenna sees, evenly; half of the headings kept, the others any."""
    layout, n, tag = listed([(150.0, 40.0, yaw)]), 20_000, np.array([5000.0, -300.0])
    ready = built(layout, area, n_particles=n, softness_mm=0.0)
    state = particle_filter.init(ready, KnownStart((0.0, 0.0, 1.0)), KEY)
    after = particles_of(ready, particle_filter.update(ready, state, read_by(0, tag)))
    seen_at = to_local(compose(after, layout.poses_mm[0]), tag)
    assert area.signed_distance(seen_at).max() < 1.0
    for axis, half in (
        (0, area.reach_mm if isinstance(area, Disc) else 60.0),
        (1, 30.0 if isinstance(area, Disc) else 20.0),
    ):
        spread = seen_at[:, axis].std() / (half / 2 if isinstance(area, Disc) else half / math.sqrt(3))
        assert spread == pytest.approx(1, abs=0.03)
        assert abs(seen_at[:, axis].mean()) < 5 * half / math.sqrt(n)
    is_kept = np.abs(after[:, 2] - 1.0) < 1e-6
    assert abs(is_kept.mean() - 0.5) < 0.001
    assert stats.kstest(after[~is_kept, 2] / (2 * np.pi) + 0.5, "uniform").pvalue > 1e-3


def test_a_restart_deals_the_reads_evenly():
    tags = np.array([[5000.0, 0.0], [8000.0, 0.0]])
    ready = built(LAYOUT, n_particles=3000)
    state = particle_filter.init(ready, KnownStart((0.0, 0.0, 0.0)), KEY)
    after = particles_of(ready, particle_filter.update(ready, state, Reads(np.array([0, 1]), tags)))
    distances = np.array([np.hypot(*(compose(after, LAYOUT.poses_mm[a])[:, :2] - tags[a]).T) for a in (0, 1)])
    assert np.bincount(distances.argmin(axis=0)).tolist() == [1500, 1500]
    assert distances.min(axis=0).max() < RADIUS + 1.0


def test_a_restart_with_rssi_is_in_the_ring():
    """Also where it is thin; one in a thousand may miss it."""
    radii = (105.0, 100.0, 95.0, 40.0)
    ready = built(LAYOUT, radii=radii, uses_rssi=True, softness_mm=0.0, n_particles=5000)
    for rssi in range(4):
        state = particle_filter.init(ready, KnownStart((0.0, 0.0, 0.0)), KEY)
        after = particles_of(ready, particle_filter.update(ready, state, read_by(1, (5000.0, 0.0), rssi)))
        distance = np.hypot(*(compose(after, LAYOUT.poses_mm[1])[:, :2] - [5000.0, 0.0]).T)
        assert distance.max() < radii[rssi] + 1
        assert np.mean(distance < (*radii, 0.0)[rssi + 1] - 1) < 2e-3


def test_particles_stay_if_one_of_them_agrees_or_restarts_are_off():
    tag = np.array([170.0, 0.0])
    for is_on, place in ((True, tag), (False, np.array([5000.0, 0.0]))):
        ready = built(LAYOUT, n_particles=500, reinitialize=is_on)
        start = UncertainStart((0.0, 0.0, 0.0), np.diag([400.0, 400.0, 0.0]).tolist())
        state = particle_filter.init(ready, start, KEY)
        after = particles_of(ready, particle_filter.update(ready, state, read_by(0, place)))
        assert np.hypot(*after[:, :2].T).max() < 100.0
