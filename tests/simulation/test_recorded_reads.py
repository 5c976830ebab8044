"""When and what readers answer: time in the field, delay, multiplexing, inventories, RSSI; brute force in numpy."""

import math

import numpy as np
import pytest
from scipy import stats

from rfiddesign.catalog import Antenna
from rfiddesign.design import Design
from rfiddesign.floor import build_tag_map
from rfiddesign.geometry import Disc, ListedPattern, Rectangle, compose, listed, make_pattern, single, to_local
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.reads import MOST_ANSWERS, ReadModel
from rfiddesign.numerics._noise_kernels import STREAM_INSTALLATION, fill_normal, step_key
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of
from rfiddesign.simulation.scenario import World

DT = 0.05
QUIET = OmnidirectionalMotion(0.0, 0.0, 0.0)
YAWED = listed([(150.0, 0.0, 0.0), (-100.0, 200.0, 0.7), (0.0, -180.0, -2.2), (-210.0, -30.0, math.pi / 2)])
KEY = key_of(3, 1)


def recorded(tags, poses, reads, area=None, layout=YAWED, radii=(), sigma=0.0, key=KEY, dt_s=DT, pattern=None):
    """What a robot without noise records among tags (n, 2)."""
    antenna = Antenna("test", (1.0, 1.0), area or Disc(radii[0]), "test", radii)
    design = Design(layout, antenna, pattern or ListedPattern(np.zeros((1, 2))))
    tags = np.asarray(tags, float).reshape(-1, 2)
    return record(design, build_tag_map(tags), np.asarray(poses, float), dt_s, World(QUIET, reads, sigma), key)


def random_floor(seed, n_tags=500, n_steps=200):
    """Tags and a drive among them."""
    rng = np.random.Generator(np.random.PCG64(seed))
    tags = rng.uniform(0, 1500, (n_tags, 2)).astype(np.float32).astype(float)
    steps = rng.normal(0, [20, 20, 0.1], (n_steps, 3))
    return tags, np.array([750.0, 750.0, 1.0]) + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def straight_drive(speed, n_steps, y=0.0):
    x = speed * DT * np.arange(n_steps + 1)
    return np.column_stack([x, np.full(n_steps + 1, y), np.zeros(n_steps + 1)])


def reads_of_step(recording, t):
    """{(antenna, tag)} of a step, and how many reads it has."""
    rows = range(recording.read_start[t], recording.read_start[t + 1])
    return {(int(recording.read_antenna[row]), int(recording.read_tag[row])) for row in rows}, len(rows)


def pose_at(poses, time):
    """True pose at a time in steps; before the first it stood."""
    time = max(time, 0.0)
    t = min(math.floor(time), len(poses) - 2)
    return poses[t] + (time - t) * (poses[t + 1] - poses[t])


def laid(tags, sigma, key=KEY):
    """Where the tags lie in truth, by the normal numbers of the run's stream."""
    normals = np.empty(2 * len(tags), np.float32)
    fill_normal(np.uint64(step_key(key, STREAM_INSTALLATION, 0)), normals)
    return tags + sigma * normals.reshape(-1, 2)


# All at once


@pytest.mark.parametrize("sigma", [0.0, 6.0])
@pytest.mark.parametrize("delay_s", [0.0, 0.035, 0.22])
@pytest.mark.parametrize("read_time_s", [0.0, 0.03, 0.12])
@pytest.mark.parametrize("polling", ["common", "staggered", "multiplexed"])
def test_an_inventory_is_exactly_the_tags_in_the_field_for_long_enough(polling, read_time_s, delay_s, sigma):
    """Of the antennas whose turn it is, where they were when the read was made and `read_time_s` before it."""
    tags, poses = random_floor(5)
    reads = ReadModel(1.0, polling, 0.02, read_time_s, delay_s, "all")
    schedule, area, true_tags = reads.schedule(4, DT), Rectangle(90.0, 60.0), laid(tags, sigma)
    recording = recorded(tags, poses, reads, area, sigma=sigma)
    for t in range(len(poses) - 1):
        expected = set()
        for a in np.flatnonzero(t % schedule.period == schedule.slots):
            time = t + schedule.phases[a] - delay_s / DT
            in_view = np.ones(len(tags), bool)
            for at in {time, time - read_time_s / DT}:
                depth = -area.signed_distance(to_local(compose(pose_at(poses, at), YAWED.poses_mm[a]), true_tags))
                assert np.abs(depth).min() > 1e-6
                in_view &= depth > 0
            expected |= {(int(a), int(tag)) for tag in np.flatnonzero(in_view)}
        found, n = reads_of_step(recording, t)
        assert n == len(found)
        assert found == expected
    assert recording.n_reads > 100
    assert recording.read_age_s == pytest.approx((1 - schedule.phases[recording.read_antenna]) * DT)
    assert np.array_equal(recording.read_tag_mm, tags[recording.read_tag])


# Time in the field


@pytest.mark.parametrize("polling", ["common", "staggered"])
def test_a_disc_reads_a_tag_only_if_its_chord_exceeds_speed_times_read_time(polling):
    """Below that never; above by a poll's way always."""
    speed, read_time_s, radius, n = 600.0, 0.08, 40.0, 400
    offsets = np.random.Generator(np.random.PCG64(2)).uniform(-radius, radius, n)
    tags = np.column_stack([200.0 * np.arange(1, n + 1), offsets])
    poses = straight_drive(speed, math.ceil(200.0 * (n + 1) / (speed * DT)))
    recording = recorded(tags, poses, ReadModel(1.0, polling, read_time_s=read_time_s), Disc(radius), single())
    is_read = np.isin(np.arange(n), recording.read_tag)
    chord = 2 * np.sqrt(radius**2 - offsets**2)
    assert not is_read[chord <= speed * read_time_s].any()
    assert is_read[chord > speed * (read_time_s + DT)].all()
    assert 0 < is_read[chord <= speed * (read_time_s + DT)].sum() < n
    # Without it all are read whose chord exceeds a poll's way.
    quick = recorded(tags, poses, ReadModel(1.0, polling), Disc(radius), single())
    assert np.isin(np.flatnonzero(chord > speed * DT), quick.read_tag).all()


def test_a_tag_in_the_field_for_too_short_a_time_keeps_none_from_answering():
    """Two tags in view, of which one has just come in: the other answers every poll."""
    layout, area = single(), Disc(40.0)
    poses = straight_drive(400.0, 200)
    rows = np.arange(1, 40) * 100.0
    tags = np.concatenate([np.column_stack([rows, np.zeros(39)]), np.column_stack([rows + 50.0, np.zeros(39)])])
    reads = ReadModel(read_time_s=0.1)
    recording = recorded(tags, poses, reads, area, layout)
    for t in range(4, 200):
        in_view = (np.abs(tags[:, 0] - poses[t + 1, 0]) < 40.0) & (np.abs(tags[:, 0] - poses[t - 1, 0]) < 40.0)
        found, n = reads_of_step(recording, t)
        assert n == in_view.any()
        assert all(in_view[tag] for _, tag in found)


def test_tags_long_enough_in_the_field_answer_alike():
    tags = [(x, y) for x in (-12.0, 12.0) for y in (-12.0, 12.0)]
    reads = ReadModel(read_probability=0.6, read_time_s=0.1)
    recording = recorded(tags, np.zeros((20_001, 3)), reads, Disc(30.0), single())
    assert abs(recording.n_reads - 12_000) < 4.5 * math.sqrt(20_000 * 0.24)
    assert stats.chisquare(np.bincount(recording.read_tag, minlength=4)).pvalue > 1e-3


def test_a_read_time_loses_nothing_of_a_robot_that_stands():
    tags, poses = random_floor(3)
    still = np.tile(poses[:1], (50, 1))
    slow, quick = (recorded(tags, still, ReadModel(read_time_s=s, answers="all"), Disc(60.0)) for s in (1.0, 0.0))
    assert slow.n_reads > 0
    assert np.array_equal(slow.read_tag, quick.read_tag)


# Delay


@pytest.mark.parametrize("polling", ["common", "staggered", "multiplexed"])
@pytest.mark.parametrize("n_late", [1, 3, 8])
def test_a_delayed_recording_is_the_undelayed_one_shifted_by_whole_steps(polling, n_late):
    """Antennas, tags, RSSI and the age that the filter is told; only the drive's begin differs."""
    tags, poses = random_floor(7)
    radii = (60.0, 40.0, 20.0)
    # Periods that divide the delay, so that the same antenna polls.
    poll_s = DT if n_late == 8 else DT / 4
    if polling == "multiplexed" and n_late == 8:
        assert ReadModel(polling=polling, poll_s=poll_s).schedule(4, DT).period == 4
    late, prompt = (
        recorded(tags, poses, ReadModel(1.0, polling, poll_s, 0.0, delay, "all"), radii=radii)
        for delay in (n_late * DT, 0.0)
    )
    for part in ("read_antenna", "read_tag", "read_rssi", "read_age_s"):
        a, b = getattr(late, part), getattr(prompt, part)
        shifted, whole = a[late.read_start[n_late] :], b[: prompt.read_start[-1 - n_late]]
        assert np.array_equal(shifted, whole)
        assert len(whole) > 100
    assert np.array_equal(np.diff(late.read_start)[n_late:], np.diff(prompt.read_start)[: -n_late or None])


def test_before_the_first_delayed_poll_the_robot_stood():
    tags, poses = random_floor(8, n_tags=3000)
    late = recorded(tags, poses, ReadModel(delay_s=4 * DT, answers="all"), Disc(60.0))
    still = recorded(tags, np.tile(poses[:1], (5, 1)), ReadModel(answers="all"), Disc(60.0))
    for t in range(4):
        assert reads_of_step(late, t) == reads_of_step(still, t)
        assert reads_of_step(late, t)[1] > 0


@pytest.mark.parametrize("delay_s", [0.0, 0.1, 0.5])
def test_a_lattice_of_tags_is_read_as_the_list_of_its_tags_also_late(delay_s):
    pattern = make_pattern("square", pitch_mm=100.0)
    tags = np.stack(np.meshgrid(*(np.arange(-10, 26) * 100.0,) * 2), axis=-1).reshape(-1, 2)
    _, poses = random_floor(9)
    reads = ReadModel(0.9, "multiplexed", 0.02, 0.06, delay_s, "all")
    by_lattice, by_list = (recorded(tags, poses, reads, Disc(40.0), pattern=p) for p in (pattern, None))
    assert by_list.n_reads > 50
    assert np.array_equal(by_lattice.read_tag, by_list.read_tag)
    assert np.array_equal(by_lattice.read_start, by_list.read_start)


# Multiplexing


@pytest.mark.parametrize("poll_s", [0.01, 0.025, 0.05, 0.1, 0.12])
@pytest.mark.parametrize("answers", ["one", "all"])
def test_of_a_multiplexer_only_the_scheduled_antennas_read(poll_s, answers):
    """A field of tags in view of all antennas at all times."""
    reads = ReadModel(polling="multiplexed", poll_s=poll_s, answers=answers)
    schedule = reads.schedule(4, DT)
    tags = YAWED.poses_mm[:, :2]
    recording = recorded(tags, np.zeros((61, 3)), reads, Disc(30.0))
    for t in range(60):
        rows = slice(recording.read_start[t], recording.read_start[t + 1])
        assert np.array_equal(recording.read_antenna[rows], np.flatnonzero(t % schedule.period == schedule.slots))
    whole = 60 // schedule.period * schedule.period
    counts = np.bincount(recording.read_antenna[: recording.read_start[whole]], minlength=4)
    assert np.array_equal(counts, np.full(4, whole // schedule.period))


# Inventories


def test_of_an_inventory_each_tag_is_read_on_its_own():
    """With read probability p the number of reads is binomial, and tags do not depend on each other."""
    n_tags, n_polls, p = 9, 20_000, 0.3
    tags = np.stack(np.meshgrid(*(np.arange(-1, 2) * 10.0,) * 2), axis=-1).reshape(-1, 2)
    reads = ReadModel(read_probability=p, answers="all")
    recording = recorded(tags, np.zeros((n_polls + 1, 3)), reads, Disc(30.0), single())
    counts = np.bincount(np.diff(recording.read_start), minlength=n_tags + 1)
    expected = n_polls * stats.binom.pmf(np.arange(n_tags + 1), n_tags, p)
    assert stats.chisquare(counts[:7], expected[:7] * counts[:7].sum() / expected[:7].sum()).pvalue > 1e-3
    assert counts[7:].sum() == pytest.approx(expected[7:].sum(), abs=4.5 * math.sqrt(expected[7:].sum()))
    by_tag = np.bincount(recording.read_tag, minlength=n_tags)
    assert np.abs(by_tag - n_polls * p).max() < 4.5 * math.sqrt(n_polls * p * (1 - p))
    seen = np.zeros((n_polls, n_tags))
    seen[np.repeat(np.arange(n_polls), np.diff(recording.read_start)), recording.read_tag] = 1
    assert np.abs(np.corrcoef(seen.T) - np.eye(n_tags)).max() < 4.5 / math.sqrt(n_polls)


def test_an_inventory_ends_after_the_most_tags_that_one_poll_returns():
    tags = np.stack(np.meshgrid(*(np.arange(-6, 6) * 2.0,) * 2), axis=-1).reshape(-1, 2)
    recording = recorded(tags, np.zeros((3, 3)), ReadModel(answers="all"), Disc(40.0), single())
    assert np.array_equal(np.diff(recording.read_start), [MOST_ANSWERS] * 2)


# RSSI


@pytest.mark.parametrize("answers", ["one", "all"])
@pytest.mark.parametrize("sigma", [0.0, 8.0])
def test_the_step_of_rssi_is_the_ring_that_the_tag_lies_in(sigma, answers):
    """Step j iff the distance lies between the radii of steps j + 1 and j, from where the tag lies in truth."""
    tags, poses = random_floor(11)
    radii = np.array([60.0, 50.0, 35.0, 20.0])
    recording = recorded(tags, poses, ReadModel(answers=answers, polling="staggered"), radii=tuple(radii), sigma=sigma)
    true_tags, phases = laid(tags, sigma), ReadModel(polling="staggered").schedule(4, DT).phases
    step = np.repeat(np.arange(len(poses) - 1), np.diff(recording.read_start))
    for t, a, tag, rssi in zip(step, recording.read_antenna, recording.read_tag, recording.read_rssi, strict=True):
        place = compose(pose_at(poses, t + phases[a]), YAWED.poses_mm[a])[:2]
        distance = math.dist(place, true_tags[tag])
        assert distance < radii[0] + 1e-6
        assert rssi == np.count_nonzero(distance < radii) - 1
    assert set(recording.read_rssi) == {0, 1, 2, 3}
    assert recording.read_rssi.dtype == np.int32


def test_reads_of_an_antenna_without_rssi_have_none():
    tags, poses = random_floor(12)
    recording = recorded(tags, poses, ReadModel(), Disc(40.0))
    assert recording.n_reads > 50
    assert (recording.read_rssi == -1).all()
