"""A tag map that was learned on drives: where each tag is believed to lie, and how surely."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rfiddesign.floor.tag_map import TagMap, build_tag_map


@dataclass(frozen=True, eq=False)
class MappedTags:
    """Tags that were read at least once.

    Parameters
    ----------
    tag_id : (n,) number of each tag, rising.
    mean_mm : (n, 2) where it is believed to lie [mm].
    covariance_mm2 : (n, 2, 2) of that place [mm^2].
    n_reads : (n,) how often it was read.

    Raises
    ------
    ValueError : if shapes do not fit, numbers do not rise or a value is not finite.
    """

    tag_id: np.ndarray
    mean_mm: np.ndarray
    covariance_mm2: np.ndarray
    n_reads: np.ndarray

    def __post_init__(self) -> None:
        n = len(self.tag_id)
        shapes = (self.tag_id.shape, self.mean_mm.shape, self.covariance_mm2.shape, self.n_reads.shape)
        if shapes != ((n,), (n, 2), (n, 2, 2), (n,)):
            raise ValueError(f"tag_id, mean_mm, covariance_mm2 and n_reads have shapes {shapes}, must be of {n} tags")
        if (np.diff(self.tag_id) <= 0).any() or (self.tag_id < 0).any():
            raise ValueError("tag_id must rise, from 0 on")
        if not (np.isfinite(self.mean_mm).all() and np.isfinite(self.covariance_mm2).all()):
            raise ValueError("mean_mm or covariance_mm2 has a value that is not finite")

    @property
    def n_tags(self) -> int:
        """Number of tags that were read."""
        return len(self.tag_id)

    def over(self, planned_mm: ArrayLike) -> np.ndarray:
        """Planned places (n_planned, 2) [mm] with those of the mapped tags in their stead.

        Raises
        ------
        ValueError : if a mapped tag is not among the planned ones.
        """
        places = np.array(planned_mm, float)
        if self.n_tags and self.tag_id[-1] >= len(places):
            raise ValueError(f"planned_mm has {len(places)} tags, but tag {self.tag_id[-1]} was mapped")
        places[self.tag_id] = self.mean_mm
        return places

    def tag_map(self, installed_mm: ArrayLike | None = None) -> TagMap:
        """The mapped tags as a map, numbered 0, 1, ... in the order of `tag_id`.

        `installed_mm` (n, 2): where these tags lie in truth, where that is known.
        """
        return build_tag_map(self.mean_mm, None if installed_mm is None else np.asarray(installed_mm))


def mapped_tags(
    tag_id: Sequence[int], mean_mm: Sequence[np.ndarray], covariance_mm2: Sequence[np.ndarray], n_reads: Sequence[int]
) -> MappedTags:
    """The map of tags given one by one, which may be none."""
    return MappedTags(
        np.array(tag_id, np.int64), np.array(mean_mm, float).reshape(-1, 2),
        np.array(covariance_mm2, float).reshape(-1, 2, 2), np.array(n_reads, np.int64),
    )  # fmt: skip
