"""Counts of floating-point operations: by hand for simple loads, and for every estimator that there is."""

import numpy as np
import pytest

from rfiddesign.estimators import mcl, registry
from rfiddesign.estimators.ekf import Ekf
from rfiddesign.estimators.geometric import METHODS, Geometric
from rfiddesign.estimators.histogram import Histogram
from rfiddesign.estimators.markov import Markov
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.estimators.operations import Load, load_of
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.geometry import Disc, make_layout
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.recording import Recording
from rfiddesign.models.robot import Robot

ROBOT = Robot(make_layout("cross-8"), Disc(30.0), (), ReadModel())
QUIET = Load(reads=0.0, read_share=0.0, polls=8.0, silent_polls=8.0)
BUSY = Load(reads=2.0, read_share=0.9, polls=8.0, silent_polls=6.0, tags_per_mm2=1e-4, spread_mm=5.0)
ALL = [
    Mcl(), ParticleFilter(), Ekf(kind="quantized"), Ekf(kind="constrained"), Markov(), Histogram(),
    *(Geometric(method=method) for method in METHODS),
]  # fmt: skip


def flops(settings, load):
    return registry.flops_per_step(registry.build(settings, ROBOT, 0.05), load)


def a_recording(read_start, read_antenna):
    n = len(read_start) - 1
    r = len(read_antenna)
    return Recording(
        0.05, np.zeros((n + 1, 3)), np.zeros((n, 3)), np.array(read_start), np.array(read_antenna, np.int32),
        np.zeros(r, np.int64), np.zeros((r, 2)), np.zeros(r),
    )  # fmt: skip


def test_a_load_is_counted_from_what_was_recorded():
    """Four steps: none, two reads of antennas 0 and 3, one of antenna 0, three tags by antenna 1 in one inventory."""
    recording = a_recording([0, 0, 2, 3, 6], [0, 3, 0, 1, 1, 1])
    load = load_of(recording, ReadModel().schedule(4, 0.05), tags_per_mm2=1e-4, spread_mm=7.0)
    assert (load.reads, load.read_share, load.polls) == (1.5, 0.75, 4.0)
    # Of 16 polls four were answered: antennas 0 and 3, 0, 1.
    assert load.silent_polls == 3.0
    assert (load.tags_per_mm2, load.spread_mm) == (1e-4, 7.0)


def test_a_multiplexer_polls_in_turn():
    schedule = ReadModel(polling="multiplexed", poll_s=0.05).schedule(8, 0.05)
    load = load_of(a_recording([0, 0, 1], [5]), schedule)
    assert load.polls == 1.0
    assert load.silent_polls == 0.5


@pytest.mark.parametrize("settings", ALL, ids=lambda settings: getattr(settings, "method", type(settings).__name__))
def test_every_estimator_counts_and_reads_never_cost_less(settings):
    assert 0 < flops(settings, QUIET) <= flops(settings, BUSY) < 1e9


def test_monte_carlo_localization_without_reads_by_hand():
    """Per particle three normals of 28, two sines and cosines of 19, 14 for eq. 1; 12 for a weight and 28 for sums."""
    assert flops(Mcl(n_particles=100), QUIET) == 100 * (3 * 28 + 2 * 19 + 14 + 12 + 28)
    # A read adds 16 per particle (a disc is alike in all directions) and the place of its antenna.
    with_read = flops(Mcl(n_particles=100), Load(1.0, 1.0, 8.0, 7.0))
    assert with_read - flops(Mcl(n_particles=100), QUIET) == 100 * (16 + 2) + 87


def test_polls_without_a_read_cost_only_those_that_learn_from_them():
    for learns, is_equal in ((False, True), (True, False)):
        filter_ = ParticleFilter(learns_from_nothing=learns)
        many, few = (Load(2.0, 0.9, 8.0, silent, 1e-4, 5.0) for silent in (6.0, 0.0))
        assert (flops(filter_, many) == flops(filter_, few)) == is_equal
    # A belief that is too vague learns nothing from them.
    vague = Load(2.0, 0.9, 8.0, 6.0, 1e-4, 500.0)
    assert flops(ParticleFilter(), vague) < flops(ParticleFilter(), BUSY)


def test_the_particle_filter_pays_per_particle_for_setting_apart_and_per_tag_for_what_it_did_not_read():
    """A particle set apart costs 13 more; a poll that read nothing one row for each tag within reach and 4 sigmas."""
    plain, apart = ({"n_particles": n, "is_regularized": on} for n, on in ((100, False), (100, True)))
    more = flops(ParticleFilter(**apart), BUSY) - flops(ParticleFilter(**plain), BUSY)
    assert more == pytest.approx(100 * 13, rel=0.1)
    # Rows by the logarithm of every eight of them, and a reach that the border's blur widens by some millimetres.
    tags = BUSY.silent_polls * BUSY.tags_per_mm2 * np.pi * (30.0 + 4 * BUSY.spread_mm) ** 2
    learns, not_ = (flops(ParticleFilter(n_particles=10_000, learns_from_nothing=on), BUSY) for on in (True, False))
    assert 24 * tags < (learns - not_) / 10_000 < 50 * tags


def test_cells_cost_by_their_number():
    small, large = (flops(Markov(n_cells=n), BUSY) for n in (51, 101))
    assert large / small == pytest.approx((101 / 51) ** 2, rel=0.1)
    assert mcl.flops_per_step is registry._MODULES[ParticleFilter].flops_per_step
