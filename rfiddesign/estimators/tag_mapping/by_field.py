"""Tags mapped by the antenna's read field: what polls read and what they did not, as mean and covariance.

A tag's window opens around the antenna that first reads it, as in `by_reads`; polls from before count as well, since
the log of the drive is kept.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from rfiddesign import require
from rfiddesign.estimators.tag_mapping.window import MAX_CELLS, Window, flat_window, moments, weigh_by_words
from rfiddesign.floor.mapped_tags import MappedTags
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
                f"distances_mm has {len(self.distances_mm)} distances, the field has {len(self.field.tables) - 2} between"
                " read and not read"
            )


def follow(settings: ByField, polls: Polls, tag: int, ends: np.ndarray) -> list[Window]:
    """What is believed of a tag's place after the first `ends[i]` polls, rising, none of them before its first read."""
    near, said = _polls_about(settings, polls, tag, cKDTree(polls.poses[:, :2]))
    return _follow(settings, polls, tag, ends, near, said)


def map_tags(settings: ByField, polls: Polls) -> MappedTags:
    """All tags that were read, after all polls."""
    tree = cKDTree(polls.poses[:, :2]) if len(polls.poses) else None
    tags, means, covariances, n_reads = [], [], [], []
    for tag in range(polls.n_tags):
        n = len(polls.reads_of(tag))
        if n == 0:
            continue
        near, said = _polls_about(settings, polls, tag, tree)
        (window,) = _follow(settings, polls, tag, np.array([len(polls.poses)]), near, said)
        mean, covariance = moments(window)
        tags.append(tag), means.append(mean), covariances.append(covariance), n_reads.append(n)
    return MappedTags(
        np.array(tags, np.int64), np.array(means, float).reshape(-1, 2), np.array(covariances, float).reshape(-1, 2, 2),
        np.array(n_reads, np.int64),
    )  # fmt: skip


def _follow(
    settings: ByField, polls: Polls, tag: int, ends: np.ndarray, near: np.ndarray, said: np.ndarray
) -> list[Window]:
    first = polls.read_poll[polls.reads_of(tag)[0]]
    window, begin, windows = flat_window(polls.poses[first, :2], settings.radius_mm, settings.cell_mm), 0, []
    for end in ends:
        if end <= first or end < begin:
            raise ValueError(f"ends has {end!r}, must rise and be above {first}, the poll that first read tag {tag}")
        some = slice(*np.searchsorted(near, (begin, end)))
        # Reads first: what they rule out, silence need not be asked about.
        order = np.argsort(said[some] == len(settings.field.tables) - 1, kind="stable")
        window = weigh_by_words(window, polls.poses[near[some][order]], said[some][order], settings.field)
        windows.append(window)
        begin = end
    return windows


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
    # The window is a square about a circle.
    near = np.array(sorted(tree.query_ball_point(centre, settings.field.reach_mm + 1.5 * settings.radius_mm)), np.int64)
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
