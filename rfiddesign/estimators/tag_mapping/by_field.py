"""Tags mapped by the antenna's read field: what polls read and what they did not, as mean and covariance.

A tag's window opens around the antenna that first reads it, as in `by_reads`; polls from before count as well, since
the log of the drive is kept.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from rfiddesign import require
from rfiddesign.estimators.tag_mapping.window import MAX_CELLS, Window, flat_window, moments, weigh_by_words
from rfiddesign.floor.mapped_tags import MappedTags, mapped_tags
from rfiddesign.models.log_field import LogField
from rfiddesign.models.polls import Polls


@dataclass(frozen=True, eq=False)
class ByField:
    """Settings.

    Parameters
    ----------
    field : what a poll says; its tables are "read", "not read", and between these, if there are any, "read at" each of
        the distances.
    distances_mm : communication distances that a poll tries, rising; none: reads are alike.
    cell_mm : side of a cell [mm].
    radius_mm : how far from the antenna that first read it a tag may be [mm].
    """

    field: LogField
    distances_mm: tuple[float, ...] = ()
    cell_mm: float = 10.0
    radius_mm: float = 3000.0

    def __post_init__(self) -> None:
        require.within("radius_mm", self.radius_mm, low=1.0, high=1e6)
        require.within("cell_mm", self.cell_mm, low=2.0 * self.radius_mm / (MAX_CELLS - 1), high=self.radius_mm)
        if self.distances_mm and len(self.field.tables) != len(self.distances_mm) + 2:
            raise ValueError(
                f"distances_mm has {len(self.distances_mm)} distances, the field tells {len(self.field.tables) - 2}"
            )


def follow(settings: ByField, polls: Polls, tag: int, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray, Window]:
    """Mean (n, 2) [mm] and covariance (n, 2, 2) [mm^2] of its place after `ends[i]` polls; the last belief.

    Raises
    ------
    ValueError : if the tag was never read, `ends` does not rise or one of them is before the tag's first read.
    """
    return _follow(settings, polls, tag, ends, cKDTree(polls.poses[:, :2]))


def map_tags(settings: ByField, polls: Polls) -> MappedTags:
    """All tags that were read, after all polls."""
    tree = cKDTree(polls.poses[:, :2]) if len(polls.poses) else None
    tags, means, covariances, n_reads = [], [], [], []
    for tag in range(polls.n_tags):
        n = len(polls.reads_of(tag))
        if n == 0:
            continue
        mean, covariance, _ = _follow(settings, polls, tag, np.array([len(polls.poses)]), tree)
        tags.append(tag), means.append(mean[0]), covariances.append(covariance[0]), n_reads.append(n)
    return mapped_tags(tags, means, covariances, n_reads)


def _follow(
    settings: ByField, polls: Polls, tag: int, ends: np.ndarray, tree: cKDTree
) -> tuple[np.ndarray, np.ndarray, Window]:
    near, said = _polls_about(settings, polls, tag, tree)
    first = polls.read_poll[polls.reads_of(tag)[0]]
    window = flat_window(polls.poses[first, :2], settings.radius_mm, settings.cell_mm)
    means, covariances, begin = np.empty((len(ends), 2)), np.empty((len(ends), 2, 2)), 0
    for k, end in enumerate(ends):
        if end <= first or end < begin:
            raise ValueError(f"ends has {end!r}, must rise and be above {first}, the poll that first read tag {tag}")
        some = slice(*np.searchsorted(near, (begin, end)))
        # Reads first: what they rule out, silence need not be asked about.
        order = np.argsort(said[some] == len(settings.field.tables) - 1, kind="stable")
        window = weigh_by_words(window, polls.poses[near[some][order]], said[some][order], settings.field)
        means[k], covariances[k] = moments(window)
        begin = end
    return means, covariances, window


def _polls_about(settings: ByField, polls: Polls, tag: int, tree: cKDTree) -> tuple[np.ndarray, np.ndarray]:
    """Polls that say anything of where a tag may lie, in the order of time, and which of the field's tables each says.

    Raises
    ------
    ValueError : if the tag was never read, or at a distance that is none of the settings'.
    """
    rows = polls.reads_of(tag)
    if len(rows) == 0:
        raise ValueError(f"tag is {tag}, which was never read")
    centre = polls.poses[polls.read_poll[rows[0]], :2]
    near = np.array(sorted(tree.query_ball_point(centre, settings.field.reach_mm + settings.radius_mm)), np.int64)
    said = np.full(len(polls.poses), len(settings.field.tables) - 1)
    if settings.distances_mm:
        distances = polls.read_distance_mm[rows]
        which = np.searchsorted(settings.distances_mm, distances)
        if (which == len(settings.distances_mm)).any() or (np.array(settings.distances_mm)[which] != distances).any():
            raise ValueError(f"polls: tag {tag} was read at a distance that is none of distances_mm")
        said[polls.read_poll[rows]] = 1 + which
    else:
        said[polls.read_poll[rows]] = 0
    return near, said[near]
