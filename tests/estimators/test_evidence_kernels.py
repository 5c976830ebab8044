"""What a step tells a particle filter, row by row, against a plain numpy twin; and where an antenna was."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st

from rfiddesign.estimators import _evidence_kernels as kernels
from rfiddesign.estimators import particle_filter
from rfiddesign.estimators._regularize_kernels import N_ABOUT
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.estimators.verbs import known, moments_of
from rfiddesign.floor import build_tag_map
from rfiddesign.geometry import Disc, compose, listed, to_local, transform_points
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.recording import Reads
from rfiddesign.models.robot import Robot

DT = 0.05
LAYOUT = listed([(150.0, 0.0, 0.0), (-100.0, 200.0, 0.7), (0.0, -180.0, -2.2), (-210.0, -30.0, math.pi / 2)])
RADII = (40.0, 30.0, 20.0)
SIDE = 1200.0


def about_of(poses):
    """What the filter keeps of particles (n, 3): their moments."""
    about = np.zeros((1, N_ABOUT))
    about[0, :10] = moments_of(poses.mean(axis=0), np.cov(poses.T, bias=True), len(poses))
    return about


def rows_of(settings, reads_model, tags, about, reads, increment, step=0):
    """Rows of evidence (n, N_READ) of a step and how many are of reads, by the compiled filter."""
    robot = Robot(LAYOUT, Disc(RADII[0]), RADII, reads_model)
    model = particle_filter.build(settings, robot, DT).model
    log = reads.log(increment, DT)
    rows = np.full((kernels.room_for_evidence(log, 0, 1, model), kernels.N_READ), np.nan, np.float32)
    n_rssi = len(RADII) if settings.uses_rssi else 0
    kernels.gather(0, *log, model[1], model[2], *model[6], n_rssi, rows)
    n = len(reads.antenna)
    n_all = n
    if settings.learns_from_nothing:
        _, _, is_inventory, *schedule, reach, table = model[7]
        *tag_arrays, per_cell, x0, y0, n_x, n_y = known(tags)
        n_all = kernels.gather_nothing_seen(
            step, 0, *log[:4], model[1], model[2], *schedule, model[6], is_inventory, reach, table, *tag_arrays,
            (per_cell, x0, y0, n_x, n_y), about, rows,
        )  # fmt: skip
    return rows[:n_all], n


def looked_at_within(settings):
    """Distance beyond which a tag's not being read says next to nothing, as the model has it."""
    robot = Robot(LAYOUT, Disc(RADII[0]), RADII, ReadModel())
    return particle_filter.build(settings, robot, DT).model[7][6]


def whereabouts(poses, at):
    """Mean place of an antenna at `at` on poses (n, 3), and the radius of 4 sigmas about it; see `_whereabouts`."""
    mean, P = poses.mean(axis=0), np.cov(poses.T, bias=True)
    ahead = transform_points(np.array([0.0, 0.0, mean[2]]), np.array(at))
    H = np.column_stack([np.eye(2), [-ahead[1], ahead[0]]])
    return mean[:2] + ahead, 4 * math.sqrt(np.linalg.eigvalsh(H @ P @ H.T)[-1])


def twin(settings, reads_model, tags_mm, poses, reads, increment, step=0):
    """The same rows in double precision, and for each antenna the tags that lie within a hair of being looked at."""
    schedule = reads_model.schedule(len(LAYOUT.poses_mm), DT)
    delay = reads_model.delay_s / DT
    reach = looked_at_within(settings)

    def antenna_row(tag, a, back, table):
        x, y, yaw = LAYOUT.poses_mm[a]
        if settings.is_age_compensated and back > 0:
            end, then = np.array(increment), np.array(increment) * (1 - back)
            x, y = to_local(end, transform_points(then, np.array([x, y])))
        return [*tag, x, y, math.cos(yaw), math.sin(yaw), -math.sin(yaw), math.cos(yaw), table]

    rows = []
    for antenna, tag, rssi, age in zip(reads.antenna, reads.tag_mm, reads.rssi, reads.age_s, strict=True):
        rows.append(antenna_row(tag, antenna, age / DT + delay, rssi + 1 if settings.uses_rssi else 0))
    doubtful = []
    if not settings.learns_from_nothing or poses[:, 2].std() > 0.4:
        return np.array(rows).reshape(-1, 9), doubtful
    n_tables = len(RADII) if settings.uses_rssi else 0
    for a in np.flatnonzero(step % schedule.period == schedule.slots):
        is_of_a = reads.antenna == a
        if is_of_a.any() and reads_model.answers == "one":
            continue
        row = antenna_row((0, 0), a, 1 - schedule.phases[a] + delay, n_tables + 1)
        place, around = whereabouts(poses, row[2:4])
        distance, far = np.hypot(*(tags_mm - place).T), reach + around
        doubtful.extend(np.flatnonzero(np.abs(distance - far) < 1e-2))
        near = tags_mm[distance < far]
        if len(near) <= 32 and far <= 50 * reach:
            is_read = [(np.abs(reads.tag_mm[is_of_a] - tag).max(axis=1) < 1e-3).any() for tag in near]
            rows.extend([*tag, *row[2:]] for tag, was_read in zip(near, is_read, strict=True) if not was_read)
    return np.array(rows).reshape(-1, 9), doubtful


@given(
    seed=st.integers(0, 2**32 - 1), polling=st.sampled_from(["common", "staggered", "multiplexed"]),
    answers=st.sampled_from(["one", "all"]), delay_s=st.sampled_from([0.0, 0.02, 0.12]), uses_rssi=st.booleans(),
    extent=st.sampled_from([0.0, 3.0, 30.0, 80.0, 300.0]), turn=st.sampled_from([0.01, 0.2, 0.8, 3.1]),
    pitch=st.sampled_from([60.0, 120.0]), is_age_compensated=st.booleans(), learns=st.booleans(),
    step=st.integers(0, 5),
)  # fmt: skip
@examples(max_examples=250)
def test_rows_of_evidence_equal_a_plain_numpy_twin(
    seed, polling, answers, delay_s, uses_rssi, extent, turn, pitch, is_age_compensated, learns, step
):
    rng = np.random.Generator(np.random.PCG64(seed))
    reads_model = ReadModel(0.9, polling, 0.02, 0.0, delay_s, answers)
    settings = ParticleFilter(
        uses_rssi=uses_rssi, is_age_compensated=is_age_compensated, learns_from_nothing=learns, n_particles=48
    )
    tags_mm = rng.uniform(0, SIDE, (int((SIDE / pitch) ** 2), 2)).astype(np.float32).astype(float)
    tags = build_tag_map(tags_mm)
    x, y = (rng.uniform(-extent, extent, (2, 48)) + SIDE / 2).astype(np.float32)
    heading = rng.uniform(-turn, turn, 48) + rng.uniform(-3, 3)
    poses = np.column_stack([x, y, heading]).astype(float)
    n_reads = int(rng.integers(0, 5))
    antenna = rng.integers(0, 4, n_reads)
    # Mostly tags that an antenna may well read.
    near = [
        np.hypot(*(tags_mm - compose(poses[0], LAYOUT.poses_mm[a])[:2]).T).argsort()[rng.integers(3)] for a in antenna
    ]
    reads = Reads(antenna, tags_mm[near].reshape(-1, 2), rng.integers(0, 3, n_reads), rng.uniform(0, DT, n_reads))
    increment = np.array([*rng.normal(0, 10, 2), rng.normal(0, 0.1)])
    arguments = (tags, about_of(poses), reads, increment, step)
    rows, n = rows_of(settings, reads_model, *arguments)
    expected, doubtful = twin(settings, reads_model, tags_mm, poses, reads, increment, step)
    if doubtful:
        return
    assert len(rows) == len(expected)
    assert np.abs(rows[:n] - expected[:n]).max(initial=0) < 1e-4
    # Of those not read the order is that of the map.
    order, by_twin = (np.lexsort(np.round(part[n:, :4]).T) for part in (rows, expected))
    assert np.abs(rows[n:][order] - expected[n:][by_twin]).max(initial=0) < 1e-3


def test_hardly_any_particle_reaches_a_tag_that_is_not_told_of():
    """Brute force over particles of Gaussians, antennas and tags: those beyond 4 sigmas, at most.

    Where there are too many, none of that antenna's is.
    """
    rng = np.random.Generator(np.random.PCG64(3))
    tags_mm = rng.uniform(0, SIDE, (150, 2)).astype(np.float32).astype(float)
    tags, n_told, n_reached, n_missed = build_tag_map(tags_mm), 0, 0, 0
    for _ in range(100):
        root = rng.normal(0, 1, (3, 3)) * [[15.0], [15.0], [0.08]]
        poses = rng.normal(0, 1, (500, 3)) @ root.T + [*rng.uniform(300, 900, 2), rng.uniform(-9, 9)]
        rows, _ = rows_of(ParticleFilter(n_particles=500), ReadModel(), tags, about_of(poses), Reads(), np.zeros(3))
        for a, pose in enumerate(LAYOUT.poses_mm):
            of_a = rows[np.abs(rows[:, 2:4] - pose[:2]).max(axis=1) < 1e-3]
            places = compose(poses, LAYOUT.poses_mm[a])[:, :2]
            in_reach = np.hypot(*np.moveaxis(places[:, None] - tags_mm, -1, 0)) < RADII[0]
            told = (np.abs(of_a[:, None, :2] - tags_mm).max(axis=2) < 1e-3).any(axis=0)
            if len(of_a) > 0:
                n_told, n_reached = n_told + told.sum(), n_reached + in_reach.sum()
                n_missed += in_reach[:, ~told].sum()
    assert n_told > 1000
    assert n_reached > 10_000
    assert n_missed < 1e-4 * n_reached


def told_of(about, tags_mm, read=None, answers="one"):
    reads = Reads() if read is None else Reads(np.array([0]), tags_mm[[read]])
    settings, model = ParticleFilter(n_particles=48), ReadModel(answers=answers)
    rows, n = rows_of(settings, model, build_tag_map(tags_mm), about, reads, np.zeros(3))
    return len(rows) - n


def test_whether_tags_are_told_of_does_not_depend_on_whether_one_was_read():
    """32 near each antenna are too few to be too many, 33 are not: read or not read."""
    about = about_of(np.random.Generator(np.random.PCG64(2)).normal(0, [2.0, 2.0, 1e-3], (48, 3)))
    for n, is_told in ((32, True), (33, False)):
        tags_mm = np.column_stack([150.0 + np.linspace(-20, 20, n), np.zeros(n)])
        assert told_of(about, tags_mm) == (n if is_told else 0)
        assert told_of(about, tags_mm, read=3, answers="all") == (n - 1 if is_told else 0)


@pytest.mark.parametrize(("spread", "is_told"), [(0.39, True), (0.41, False)])
def test_particles_that_turn_too_much_are_told_nothing(spread, is_told):
    about = about_of(np.zeros((48, 3)))
    about[0, 8] = spread**2
    assert (told_of(about, LAYOUT.poses_mm[:, :2] + 1.0) > 0) == is_told


@pytest.mark.parametrize("scale", [1e8, 1e12, 1e300, np.nan])
def test_a_belief_all_over_the_world_says_nothing_and_does_no_harm(scale):
    about = about_of(np.zeros((48, 3)))
    about[0, [3, 5]] = scale
    assert told_of(about, np.random.Generator(np.random.PCG64(5)).uniform(-500, 500, (20, 2))) == 0


def test_a_read_tag_is_known_again_in_the_map_also_in_double_precision():
    """33.333 is not a number of single precision: it must not count as a tag that was not read."""
    tags_mm = np.array([[100 / 3, 200 / 3]])
    about = about_of(np.tile([100 / 3 - 150.0, 200 / 3, 0.0], (48, 1)))
    reads = Reads(np.array([0]), tags_mm)
    settings = ParticleFilter(n_particles=48)
    rows, n = rows_of(settings, ReadModel(answers="all"), build_tag_map(tags_mm), about, reads, np.zeros(3))
    assert (len(rows), n) == (1, 1)


@pytest.mark.parametrize(("rssi", "table"), [(-1, 0), (0, 1), (2, 3), (3, 3), (200, 3), (-9, 0)])
def test_a_strength_that_the_antenna_does_not_know_is_its_strongest_or_none(rssi, table):
    reads = Reads(np.array([0]), np.zeros((1, 2)), np.array([rssi]))
    settings = ParticleFilter(uses_rssi=True, learns_from_nothing=False)
    rows, _ = rows_of(settings, ReadModel(), build_tag_map(np.zeros((1, 2))), None, reads, np.zeros(3))
    assert rows[0, 8] == table


# Reads that are older than the step


@given(
    increment=st.tuples(st.floats(-100, 100), st.floats(-100, 100), st.floats(-2, 2)),
    phase=st.floats(0, 1),
    antenna=st.tuples(st.floats(-400, 400), st.floats(-400, 400)),
    start=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-3, 3)),
)
def test_an_old_read_is_applied_to_where_its_antenna_was(increment, phase, antenna, start):
    """A robot that drives straight and turns evenly over the step, as the simulated one does."""
    start = np.array(start)
    end = compose(start, np.array(increment))
    at_poll = np.array([*start[:2] + phase * (end[:2] - start[:2]), start[2] + phase * increment[2]])
    expected = to_local(end, transform_points(at_poll, np.array(antenna)))
    assert np.abs(np.array(kernels.antenna_then(*antenna, 1 - phase, *increment)) - expected).max() < 1e-9


def test_a_read_of_now_is_applied_to_where_its_antenna_is():
    for x, y in np.random.Generator(np.random.PCG64(9)).uniform(-200, 200, (3, 2)):
        assert kernels.antenna_then(x, y, 0.0, 9.0, 3.0, 0.2) == (x, y)
