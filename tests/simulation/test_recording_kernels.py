"""What robots record, against a brute force over all tags in numpy and shapely."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from rfiddesign.catalog import Antenna
from rfiddesign.design import Design
from rfiddesign.floor import build_tag_map
from rfiddesign.geometry import (
    Disc,
    Ellipse,
    ListedPattern,
    PolygonArea,
    ProbabilityMap,
    Rectangle,
    Ring,
    RoundedRectangle,
    between,
    compose,
    listed,
    make_pattern,
    to_local,
)
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.read_field import read_field
from rfiddesign.models.reads import ReadModel
from rfiddesign.simulation import _recording_kernels as kernels
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of
from rfiddesign.simulation.scenario import World

DT = 0.05
QUIET = OmnidirectionalMotion(0.0, 0.0, 0.0)
YAWED = listed([(150.0, 0.0, 0.0), (-100.0, 200.0, 0.7), (0.0, -180.0, -2.2), (-210.0, -30.0, math.pi / 2)])
AREAS = [
    Disc(30.0),
    Rectangle(320.0, 230.0),
    RoundedRectangle(80.0, 60.0, 10.0),
    Ellipse(90.0, 40.0),
    Ring(30.0, 70.0),
    PolygonArea(((-30.0, -20.0), (70.0, -10.0), (10.0, 50.0))),
]


def a_design(area, layout=YAWED):
    return Design(layout, Antenna("test", (1.0, 1.0), area, "test"), ListedPattern(np.zeros((1, 2))))


def random_drive(n_steps, rng, extent=1500.0):
    steps = rng.normal(0, [20, 20, 0.1], (n_steps, 3))
    return np.array([extent / 2, extent / 2, 1.0]) + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def record_still(tags, area, n_steps, key=0, pose=(0.0, 0.0, 0.0), world=None, layout=None):
    """A robot that stands at `pose`."""
    poses = np.tile(np.array(pose), (n_steps + 1, 1))
    world = world or World(QUIET)
    return record(
        a_design(area, layout or listed([(0.0, 0.0, 0.0)])), build_tag_map(np.array(tags, float)), poses, DT, world,
        key_of(1, key),
    )  # fmt: skip


# Reads


@pytest.mark.parametrize("polling", ["common", "staggered"])
@pytest.mark.parametrize("area", AREAS, ids=lambda area: type(area).__name__)
def test_exactly_the_antennas_with_a_tag_in_view_read_one_of_those_in_view(area, polling):
    rng = np.random.Generator(np.random.PCG64(5))
    tags = rng.uniform(0, 1500, (700, 2)).astype(np.float32).astype(float)
    poses, reads = random_drive(400, rng), ReadModel(polling=polling)
    recording = record(a_design(area), build_tag_map(tags), poses, DT, World(QUIET, reads), key_of(3, 1))
    phases = reads.schedule(4, DT).phases
    # A tabulated border is that of its cells.
    doubt = 1e-6 if len(read_field(area).table) == 0 else 1.0
    n_doubtful = 0
    for t in range(400):
        rows = range(recording.read_start[t], recording.read_start[t + 1])
        tag_read_by = {int(recording.read_antenna[row]): int(recording.read_tag[row]) for row in rows}
        assert len(tag_read_by) == len(rows)
        for a, phase in enumerate(phases):
            robot = poses[t] + phase * (poses[t + 1] - poses[t])
            distance = area.signed_distance(to_local(compose(robot, YAWED.poses_mm[a]), tags))
            n_doubtful += bool((np.abs(distance) <= doubt).any())
            if a in tag_read_by:
                assert distance[tag_read_by[a]] <= doubt
            else:
                assert not (distance < -doubt).any()
    assert recording.n_reads > 100
    assert n_doubtful < 0.5 * 400 * 4
    # Reads say where the map has their tag, and how old they are.
    assert np.array_equal(recording.read_tag_mm, tags[recording.read_tag])
    assert recording.read_age_s == pytest.approx((1 - phases[recording.read_antenna]) * DT)


@pytest.mark.parametrize("n_tags", [2, 3, 7])
def test_each_tag_in_view_is_read_alike(n_tags):
    angles = 2 * np.pi * np.arange(n_tags) / n_tags
    tags = [*np.column_stack([10 * np.cos(angles), 10 * np.sin(angles)]), (500.0, 0.0)]
    recording = record_still(tags, Disc(30.0), 40_000)
    assert recording.n_reads == 40_000
    counts = np.bincount(recording.read_tag, minlength=n_tags + 1)
    assert counts[-1] == 0
    assert stats.chisquare(counts[:-1]).pvalue > 1e-3
    # And each poll anew.
    pairs = np.histogram2d(recording.read_tag[:-1], recording.read_tag[1:], bins=n_tags)[0]
    assert stats.chisquare(pairs.ravel()).pvalue > 1e-4


def test_a_poll_returns_a_tag_with_the_read_probability():
    world = World(QUIET, ReadModel(read_probability=0.3))
    recording = record_still([(0.0, 0.0), (10.0, 0.0)], Disc(30.0), 40_000, world=world)
    assert abs(recording.n_reads - 12_000) < 4.5 * math.sqrt(40_000 * 0.3 * 0.7)
    share = np.count_nonzero(recording.read_tag) / recording.n_reads
    assert abs(share - 0.5) < 4.5 * 0.5 / math.sqrt(recording.n_reads)
    for probability, n_reads in ((0.0, 0), (1.0, 1000)):
        world = World(QUIET, ReadModel(read_probability=probability))
        assert record_still([(0.0, 0.0)], Disc(30.0), 1000, world=world).n_reads == n_reads


def test_a_tag_in_a_cell_of_a_probability_map_is_read_with_its_probability():
    area = ProbabilityMap(np.array([[0.9, 0.1, 0.0], [0.6, 1.0, 0.4]]), 20.0)
    for x, y, probability in ((-20, -10, 0.9), (0, -10, 0.1), (20, -10, 0.0), (-20, 10, 0.6), (0, 10, 1.0)):
        n_reads = record_still([(float(x), float(y))], area, 20_000).n_reads
        assert abs(n_reads - 20_000 * probability) <= 4.5 * math.sqrt(20_000 * probability * (1 - probability))


def test_a_floor_without_tags_is_silent():
    assert record_still(np.empty((0, 2)), Rectangle(320.0, 230.0), 50).n_reads == 0


def test_a_robot_far_off_the_tags_reads_nothing():
    for pose in ((1e6, 0, 0), (-1e6, 0, 0), (0, 1e6, 0), (0, -1e6, 0)):
        assert record_still([(0.0, 0.0), (100.0, 50.0)], Disc(30.0), 5, pose=pose).n_reads == 0


# Installation error


def test_a_tag_lies_where_it_was_laid_for_a_whole_run():
    world = World(QUIET, installation_error_mm=25.0)
    for key in range(40):
        recording = record_still([(0.0, 0.0)], Disc(30.0), 20, key=key, world=world)
        assert recording.n_reads in (0, 20)
        assert np.array_equal(recording.read_tag_mm, np.zeros((recording.n_reads, 2)))


def test_tags_are_laid_with_a_normal_error_per_axis_afresh_for_every_run():
    """A disc of radius r about a tag's place on the map still finds it with chance 1 - exp(-r^2 / (2 sigma^2))."""
    grid = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0)), axis=-1).reshape(-1, 2) * 1000
    world, sigma = World(QUIET, installation_error_mm=25.0), 25.0
    for radius in (10.0, 30.0, 60.0):
        seen = [
            record(
                a_design(Disc(radius), listed([(x, y, 0.0) for x, y in grid])), build_tag_map(grid), np.zeros((2, 3)),
                DT, world, key_of(1, key),
            ).n_reads
            for key in range(25)
        ]  # fmt: skip
        share = 1 - math.exp(-(radius**2) / (2 * sigma**2))
        n = 400 * 25
        assert abs(sum(seen) - n * share) < 4.5 * math.sqrt(n * share * (1 - share))
        assert len(set(seen)) > 3


def test_neighbouring_tags_err_independently_along_both_axes():
    """Rectangles half a sigma wide ask for one axis at a time: the shares of seen tags multiply."""
    grid = np.column_stack([np.arange(2000) * 1000.0, np.zeros(2000)])
    layout = listed([(x, y, 0.0) for x, y in grid])
    world, tags = World(QUIET, installation_error_mm=20.0), build_tag_map(grid)

    def seen(length, width):
        design = a_design(Rectangle(length, width), layout)
        recording = record(design, tags, np.zeros((2, 3)), DT, world, key_of(2, 2))
        return np.isin(np.arange(2000), recording.read_tag)

    along, across, both = seen(26.0, 1000.0), seen(1000.0, 26.0), seen(26.0, 26.0)
    assert np.array_equal(both, along & across)
    share = 2 * stats.norm.cdf(13 / 20) - 1
    limit = 4.5 / math.sqrt(2000)
    assert abs(along.mean() - share) < limit / 2
    assert abs(across.mean() - share) < limit / 2
    for a, b in ((along, across), (along[:-1], along[1:]), (across[:-1], along[1:])):
        assert abs(np.corrcoef(a, b)[0, 1]) < limit


# Odometry


def test_odometry_without_noise_leads_from_pose_to_pose():
    poses = random_drive(300, np.random.Generator(np.random.PCG64(1)))
    recording = record(a_design(Disc(30.0)), build_tag_map(np.zeros((1, 2))), poses, DT, World(QUIET), key_of(0, 0))
    assert np.abs(recording.odometry - between(poses[:-1], poses[1:])).max() < 1e-9


def test_odometry_noise_is_white_and_the_same_for_every_design():
    motion = OmnidirectionalMotion(40.0, 20.0, 0.1)
    poses = random_drive(20_000, np.random.Generator(np.random.PCG64(2)))
    tags = build_tag_map(np.zeros((1, 2)))
    first = record(a_design(Disc(30.0)), tags, poses, DT, World(motion), key_of(0, 4)).odometry
    other = record(
        a_design(Ring(3.0, 4.0), listed([(0, 0, 0)])),
        build_tag_map(np.ones((9, 2))),
        poses,
        DT,
        World(motion),
        key_of(0, 4),
    )
    assert np.array_equal(first, other.odometry)
    noise = (first - between(poses[:-1], poses[1:])) / np.sqrt(motion.noise(DT)[:, 0])
    limit = 4.5 / math.sqrt(20_000)
    assert np.abs(noise.mean(axis=0)).max() < limit
    assert np.abs(noise.var(axis=0) - 1).max() < limit * math.sqrt(2)
    assert np.abs(np.corrcoef(noise.T) - np.eye(3)).max() < limit
    for axis in range(3):
        assert abs(np.corrcoef(noise[:-1, axis], noise[1:, axis])[0, 1]) < limit


# Errors


@settings(max_examples=100, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), turns=st.integers(-50, 50))
def test_pose_errors_are_distances_and_the_short_way_round(seed, turns):
    rng = np.random.Generator(np.random.PCG64(seed))
    truth, poses = rng.uniform(-1e4, 1e4, (2, 30, 3))
    truth[:, 2] = rng.uniform(-3, 3, 30) + 2 * np.pi * turns
    poses[:, 2] = rng.uniform(-np.pi, np.pi, 30)
    position, heading = np.full(30, -1.0), np.full(30, -1.0)
    kernels.pose_errors(truth, poses, 5, 25, position, heading)
    assert position[5:25] == pytest.approx(np.hypot(*(poses - truth)[5:25, :2].T))
    assert heading[5:25] == pytest.approx(np.abs(np.angle(np.exp(1j * (poses - truth)[5:25, 2]))), abs=1e-9)
    assert (np.concatenate([position[:5], position[25:], heading[:5], heading[25:]]) == -1).all()


@pytest.mark.parametrize("polling", ["common", "staggered"])
@pytest.mark.parametrize("sigma", [0.0, 8.0])
@pytest.mark.parametrize("kind", ["square", "triangular", "striped"])
def test_asking_the_lattice_first_loses_no_read(kind, sigma, polling):
    """A lattice pattern and the list of its tags are the same floor.

    Also far from the origin, for antennas that do not fill whole groups of lanes, and where a step turns by more than
    half a turn.
    """
    pattern, rng = make_pattern(kind, pitch_mm=100.0), np.random.Generator(np.random.PCG64(12))
    layout = listed([tuple(pose) for pose in rng.uniform([-300, -300, -3], [300, 300, 3], (21, 3))])
    world, key = World(QUIET, ReadModel(polling=polling), installation_error_mm=sigma), key_of(4, 2)
    for x, y in ((0.0, 0.0), (900_000.0, -700_000.0)):
        tags = build_tag_map(pattern.lay(shapely.box(x - 2000, y - 2000, x + 2000, y + 2000)))
        turns = np.where(rng.random(400) < 0.1, rng.uniform(-9, 9, 400), rng.normal(0, 0.05, 400))
        steps = np.cumsum(np.column_stack([rng.normal(0, 20, (400, 2)), turns]), axis=0)
        poses = np.array([x, y, 0.0]) + steps
        by_lattice, by_list = (
            record(Design(layout, Antenna("test", (1.0, 1.0), Disc(30.0), "test"), p), tags, poses, DT, world, key)
            for p in (pattern, ListedPattern(np.zeros((1, 2))))
        )
        assert by_lattice.n_reads > 400
        assert np.array_equal(by_lattice.read_tag, by_list.read_tag)
        assert np.array_equal(by_lattice.read_antenna, by_list.read_antenna)
