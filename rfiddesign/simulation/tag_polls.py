"""Polls of a robot whose pose is known: which tags its antennas read, and at which communication distance."""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from rfiddesign.geometry import compose
from rfiddesign.models.lobe import Lobe
from rfiddesign.models.polls import MAX_POLLS, Polls

# Pairs of a poll and a tag near it.
MAX_PAIRS = 20_000_000
# A tag whose distance differs from the one needed by more standard deviations is as good as never read.
_SIGMAS = 4.0


def antenna_poses(poses: ArrayLike, mountings: ArrayLike) -> np.ndarray:
    """Poses (n * m, 3) of m antennas that all poll at each of n poses of the robot, in the order of time.

    Parameters
    ----------
    poses : (n, 3) x [mm], y [mm], heading [rad] of the robot.
    mountings : (m, 3) the same of each antenna in the robot's frame.
    """
    poses, mountings = np.asarray(poses, float), np.asarray(mountings, float)
    if len(poses) * len(mountings) > MAX_POLLS:
        raise ValueError(f"poses has {len(poses):,} rows, at most {MAX_POLLS // len(mountings):,} are allowed")
    return compose(poses[:, None], mountings).reshape(-1, 3)


def poll_tags(
    lobe: Lobe, poses: np.ndarray, tags_mm: np.ndarray, distances_mm: tuple[float, ...], rng: np.random.Generator, *,
    signal_db: float = 0.0,
) -> Polls:  # fmt: skip
    """Let antennas at `poses` (n, 3) poll tags (m, 2), each at rising communication distances until it is read.

    `signal_db` is how much stronger tags answer than the communication distances are named after; 40 dB are ten times
    the distance (eq. 2 of tag_mapping_adaptive_likelihood).

    Raises
    ------
    ValueError : if there are more than 20 million pairs of a poll and a tag near it.
    """
    distances = np.asarray(distances_mm, float)
    reaches = distances * 10.0 ** (signal_db / 40.0)
    reach = reaches[-1] * math.exp(_SIGMAS * lobe.softness) * math.hypot(1.0, lobe.ratio)
    tree = cKDTree(tags_mm)
    counts = tree.query_ball_point(poses[:, :2], reach, return_length=True)
    if counts.sum() > MAX_PAIRS:
        raise ValueError(f"polls have {counts.sum():,} tags near them in all, at most {MAX_PAIRS:,} are allowed")
    near = tree.query_ball_point(poses[:, :2], reach, return_sorted=True)
    poll = np.repeat(np.arange(len(poses)), counts)
    tag = np.fromiter((number for some in near for number in some), np.int64, counts.sum())
    d, (c, s) = tags_mm[tag] - poses[poll, :2], (np.cos(poses[poll, 2]), np.sin(poses[poll, 2]))
    places = np.stack([c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0]], axis=-1)
    chances = lobe.probability(places[:, None], reaches)
    answers = rng.random(chances.shape) < chances
    is_read = answers.any(axis=1)
    at = distances[answers.argmax(axis=1)]
    return Polls(poses, poll[is_read], tag[is_read], at[is_read], len(tags_mm))
