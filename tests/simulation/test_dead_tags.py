"""Tags that never answer: drawn for each run's floor, whatever the robot, and read by no kind of reader."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy import stats

from rfiddesign.catalog import Antenna, antenna
from rfiddesign.design import Design
from rfiddesign.evaluate import evaluate
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import Disc, ListedPattern, ProbabilityMap, Rectangle, listed, make_layout, make_pattern
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.numerics._noise_kernels import STREAM_DEAD, fill_fine_uniform, step_key
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of
from rfiddesign.simulation.scenario import Scenario, World

DT = 0.05
QUIET = OmnidirectionalMotion(0.0, 0.0, 0.0)
GRID = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0)), axis=-1).reshape(-1, 2) * 1000.0
AREAS = [Disc(60.0), ProbabilityMap(np.array([[0.9, 0.6, 0.9], [0.6, 1.0, 0.6]]), 40.0)]


def a_design(area, places):
    return Design(listed(places), Antenna("test", (1.0, 1.0), area, "test"), ListedPattern(np.zeros((1, 2))))


def answering(share, key, area=None, turned=0.0, order=slice(None), reads=None):
    """Which tags of a grid answer to a standing robot that has an antenna over each, bool (400,)."""
    design = a_design(area or Disc(30.0), [(x, y, turned) for x, y in GRID[order]])
    world = World(QUIET, reads or ReadModel(), dead_share=share)
    return np.isin(np.arange(400), record(design, build_tag_map(GRID), np.zeros((2, 3)), DT, world, key).read_tag)


def dead_of(n_tags, share, key):
    """Which tags are dead, by the numbers of the run's stream."""
    draws = np.empty(n_tags)
    fill_fine_uniform(np.uint64(step_key(key, STREAM_DEAD, 0)), draws)
    return draws < share


def random_drive(seed, n_steps=200):
    rng = np.random.Generator(np.random.PCG64(seed))
    tags = rng.uniform(0, 1500, (900, 2)).astype(np.float32).astype(float)
    steps = rng.normal(0, [20, 20, 0.1], (n_steps, 3))
    return tags, np.array([750.0, 750.0, 1.0]) + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def polls_with_a_read(recording):
    """{(step, antenna)} of the polls that returned a tag."""
    steps = np.repeat(np.arange(recording.n_steps), np.diff(recording.read_start))
    return set(zip(steps.tolist(), recording.read_antenna.tolist(), strict=True))


# Which


@pytest.mark.parametrize("share", [0.01, 0.05, 0.4, 0.9])
def test_the_share_is_that_of_each_tag_of_each_run_on_its_own(share):
    is_dead = np.array([~answering(share, key_of(1, run)) for run in range(50)])
    n = is_dead.size
    assert abs(is_dead.sum() - n * share) < 4.5 * math.sqrt(n * share * (1 - share))
    # Runs, and tags over the runs, are binomial: chi-square of their counts.
    for axis in (0, 1):
        n_each = is_dead.shape[axis]
        counts = is_dead.sum(axis=axis)
        spread = ((counts - n_each * share) ** 2).sum() / (n_each * share * (1 - share))
        assert 1e-4 < stats.chi2.sf(spread, counts.size) < 1 - 1e-4
    # Neither neighbours nor one tag in successive runs depend on each other.
    for a, b in ((is_dead[:, :-1], is_dead[:, 1:]), (is_dead[:-1], is_dead[1:])):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 4.5 / math.sqrt(a.size)


def test_no_tag_is_dead_at_0_and_every_one_at_1():
    for run in range(5):
        assert answering(0.0, key_of(1, run)).all()
        assert not answering(1.0, key_of(1, run)).any()


def test_a_larger_share_keeps_the_dead_dead():
    """A study over shares compares floors that differ by the tags that are added."""
    floors = [answering(share, key_of(2, 0)) for share in (0.0, 0.05, 0.1, 0.3, 0.7)]
    for more, fewer in pairwise(floors):
        assert not (fewer & ~more).any()
        assert fewer.sum() < more.sum()


def test_dead_tags_are_those_of_the_run_s_stream_for_every_design():
    for run in range(3):
        key, backwards = key_of(3, run), slice(None, None, -1)
        expected = ~dead_of(400, 0.3, key)
        assert np.array_equal(answering(0.3, key), expected)
        assert np.array_equal(answering(0.3, key, Rectangle(80.0, 50.0), 0.7, backwards), expected)
        assert np.array_equal(answering(0.3, key, reads=ReadModel(answers="all", polling="staggered")), expected)
    assert (dead_of(400, 0.3, key_of(3, 0)) != dead_of(400, 0.3, key_of(3, 1))).any()


def test_dead_tags_are_the_same_for_any_number_of_workers():
    design = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=60.0))
    scenario = Scenario(rectangle_floor(4000.0, 3000.0, 300.0), world=World(dead_share=0.3), duration_s=5.0)
    alone, together = (evaluate(design, scenario, 6, seed=5, n_workers=n).runs for n in (1, 3))
    assert alone == together
    assert alone != evaluate(design, replace(scenario, world=World()), 6, seed=5, n_workers=1).runs


# What it does


@pytest.mark.parametrize("area", AREAS, ids=lambda area: type(area).__name__)
@pytest.mark.parametrize("sigma", [0.0, 6.0])
@pytest.mark.parametrize("read_time_s", [0.0, 0.06])
@pytest.mark.parametrize("answers", ["one", "all"])
def test_no_reader_ever_reads_a_dead_tag(answers, read_time_s, sigma, area):
    tags, poses = random_drive(4)
    reads = ReadModel(0.9, "staggered", 0.01, read_time_s, 0.02, answers)
    design, key = a_design(area, [(150.0, 0.0, 0.0), (-100.0, 200.0, 0.7)]), key_of(4, 0)
    recording = record(design, build_tag_map(tags), poses, DT, World(QUIET, reads, sigma, dead_share=0.3), key)
    is_read = np.isin(np.arange(900), recording.read_tag)
    assert recording.n_reads > 100
    assert not (is_read & dead_of(900, 0.3, key)).any()
    # Nor are they strangers to the robot: without the fault they answer.
    whole = record(design, build_tag_map(tags), poses, DT, World(QUIET, reads, sigma), key)
    assert np.isin(whole.read_tag, np.flatnonzero(dead_of(900, 0.3, key))).mean() == pytest.approx(0.3, abs=0.15)


@pytest.mark.parametrize("sigma", [0.0, 6.0])
@pytest.mark.parametrize("read_time_s", [0.0, 0.06])
def test_an_inventory_loses_the_dead_tags_and_no_other(read_time_s, sigma):
    tags, poses = random_drive(5)
    design, key = a_design(Disc(60.0), [(150.0, 0.0, 0.0), (-100.0, 200.0, 0.7)]), key_of(5, 0)
    reads = ReadModel(read_time_s=read_time_s, answers="all")
    some, every = (
        record(design, build_tag_map(tags), poses, DT, World(QUIET, reads, sigma, dead_share=share), key)
        for share in (0.4, 0.0)
    )
    is_alive = ~dead_of(900, 0.4, key)[every.read_tag]
    assert 0 < is_alive.sum() < is_alive.size
    assert np.array_equal(some.read_tag, every.read_tag[is_alive])
    assert np.array_equal(some.read_antenna, every.read_antenna[is_alive])
    assert np.array_equal(some.read_age_s, every.read_age_s[is_alive])


@pytest.mark.parametrize("read_time_s", [0.0, 0.06])
def test_a_dead_tag_keeps_no_other_from_answering(read_time_s):
    """A poll that returns one tag returns one wherever an inventory finds a living one."""
    tags, poses = random_drive(6)
    design, key = a_design(Disc(60.0), [(150.0, 0.0, 0.0), (-100.0, 200.0, 0.7)]), key_of(6, 0)
    one, every = (
        record(
            design, build_tag_map(tags), poses, DT,
            World(QUIET, ReadModel(read_time_s=read_time_s, answers=answers), dead_share=0.5), key,
        )
        for answers in ("one", "all")
    )  # fmt: skip
    assert every.n_reads > one.n_reads > 100
    assert polls_with_a_read(one) == polls_with_a_read(every)


def test_living_tags_in_view_answer_alike():
    angles = 2 * np.pi * np.arange(7) / 7
    tags = 10 * np.column_stack([np.cos(angles), np.sin(angles)])
    key = next(key for key in map(key_of, [7] * 99, range(99)) if dead_of(7, 0.5, key).sum() == 3)
    world = World(QUIET, dead_share=0.5)
    recording = record(
        a_design(Disc(30.0), [(0.0, 0.0, 0.0)]), build_tag_map(tags), np.zeros((20_001, 3)), DT, world, key
    )
    counts = np.bincount(recording.read_tag, minlength=7)
    assert recording.n_reads == 20_000
    assert np.array_equal(counts == 0, dead_of(7, 0.5, key))
    assert stats.chisquare(counts[counts > 0]).pvalue > 1e-3


def test_a_dead_tag_takes_no_place_among_those_that_one_poll_returns():
    """Of more tags than an inventory returns, the living ones fill it."""
    tags = np.stack(np.meshgrid(*(np.arange(-8, 8) * 2.0,) * 2), axis=-1).reshape(-1, 2)
    world = World(QUIET, ReadModel(answers="all"), dead_share=0.5)
    recording = record(
        a_design(Disc(40.0), [(0.0, 0.0, 0.0)]), build_tag_map(tags), np.zeros((3, 3)), DT, world, key_of(8, 0)
    )
    assert np.diff(recording.read_start).tolist() == [64, 64]


def test_dead_tags_make_errors_larger():
    design = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=60.0))
    scenario = Scenario(rectangle_floor(4000.0, 3000.0, 300.0), duration_s=20.0)
    errors = [
        evaluate(design, replace(scenario, world=World(dead_share=share)), 6, seed=5).metrics()["position_mean_mm"].mean
        for share in (0.0, 0.9)
    ]
    assert errors[1] > 1.5 * errors[0]
