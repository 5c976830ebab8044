"""Tags mapped from their reads alone, by ellipses ahead of the antenna (tag_mapping_adaptive_likelihood, section II).

The first read of a tag opens a window of cells around the antenna, all alike; each read multiplies them by its
likelihood; the tag is taken to be at the centre of gravity of the cells that are best.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from rfiddesign import require
from rfiddesign.estimators.tag_mapping import _observation_kernels as kernels
from rfiddesign.estimators.tag_mapping.likelihood import FixedLikelihood, Likelihood
from rfiddesign.estimators.tag_mapping.window import (
    MAX_CELLS,
    MAX_EXACT,
    Window,
    flat_window,
    moments,
    peak,
    weigh_by_ellipses,
)
from rfiddesign.floor.mapped_tags import MappedTags, mapped_tags
from rfiddesign.models.polls import Polls


@dataclass(frozen=True)
class ByReads:
    """Settings.

    Parameters
    ----------
    likelihood : of a read, by where the tag lies.
    cell_mm : way from virtual position to virtual position [mm].
    radius_mm : how far from the antenna that first read it a tag may be [mm].
    """

    likelihood: Likelihood = field(default_factory=FixedLikelihood)
    cell_mm: float = 10.0
    radius_mm: float = 3000.0

    def __post_init__(self) -> None:
        require.within("radius_mm", self.radius_mm, low=1.0, high=1e6)
        require.within("cell_mm", self.cell_mm, low=2.0 * self.radius_mm / (MAX_CELLS - 1), high=self.radius_mm)


@dataclass(frozen=True, eq=False)
class Belief:
    """What is known of one tag: its window, none before its first read, and how often it was read."""

    window: Window | None = None
    n_reads: int = 0


def init() -> Belief:
    """A tag that was not read yet."""
    return Belief()


def update(settings: ByReads, state: Belief, pose: ArrayLike, distance_mm: float) -> Belief:
    """Use a read of an antenna at a pose (3,) [mm, mm, rad] at a communication distance [mm]."""
    window = state.window
    if window is None:
        window = flat_window(np.asarray(pose, float)[:2], settings.radius_mm, settings.cell_mm)
    return Belief(weigh_by_ellipses(window, pose, settings.likelihood.ellipses(distance_mm)), state.n_reads + 1)


def estimate(state: Belief) -> tuple[np.ndarray, np.ndarray]:
    """Where the tag is taken to be (2,) [mm], and the mean square (2, 2) [mm^2] of where else it may be from there.

    Raises
    ------
    ValueError : if it was not read yet.
    """
    if state.window is None:
        raise ValueError("state: the tag was not read yet")
    place, (mean, covariance) = peak(state.window), moments(state.window)
    return place, covariance + np.outer(mean - place, mean - place)


def follow(settings: ByReads, polls: Polls, tag: int) -> tuple[np.ndarray, Belief]:
    """Where a tag is taken to be after each of its reads (n, 2) [mm], and the belief in the end."""
    rows = polls.reads_of(tag)
    places = np.empty((len(rows), 2))
    state = _after(settings, polls, rows, places)
    return places, state


def map_tags(settings: ByReads, polls: Polls) -> MappedTags:
    """All tags that were read."""
    tags, places, covariances, n_reads = [], [], [], []
    for tag in range(polls.n_tags):
        rows = polls.reads_of(tag)
        if len(rows) == 0:
            continue
        place, covariance = estimate(_after(settings, polls, rows, np.empty((0, 2))))
        tags.append(tag), places.append(place), covariances.append(covariance), n_reads.append(len(rows))
    return mapped_tags(tags, places, covariances, n_reads)


def _after(settings: ByReads, polls: Polls, rows: np.ndarray, places: np.ndarray) -> Belief:
    """The belief after some reads; `places`, if it has rows, receives where the tag is taken to be after each."""
    if len(rows) == 0:
        return init()
    poses = polls.poses[polls.read_poll[rows]]
    distances, which = np.unique(polls.read_distance_mm[rows], return_inverse=True)
    said = [settings.likelihood.ellipses(distance) for distance in distances]
    ellipses = np.array([one[:4] for one in said])[which]
    window = flat_window(poses[0, :2], settings.radius_mm, settings.cell_mm)
    n = len(window.logs)
    _, lowered = kernels.weigh_by_reads(
        window.logs, np.array(window.box), *window.low_mm, window.cell_mm, poses, ellipses, said[0].ratio, MAX_EXACT,
        0.0, np.empty(n, np.int32), np.empty(n, np.float32), places,
    )  # fmt: skip
    places[:] = np.array(window.centre_mm) + window.cell_mm * places
    scale = window.log_scale + lowered + sum(said[k].far_log for k in which.tolist())
    return Belief(Window(window.centre_mm, window.cell_mm, window.logs, scale), len(rows))
