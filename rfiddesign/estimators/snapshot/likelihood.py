"""The likelihood of a snapshot, evaluated directly from a detection field (uhf_snapshots, eqs. 4 and 7 to 9)."""

import numpy as np
from scipy.special import gammaln

from rfiddesign.models.detection_field import DetectionField


def weighed_tags(counts: np.ndarray, chances: np.ndarray, most: int) -> np.ndarray:
    """Numbers of the tags that count (eq. 9): those read, most often first, and the likeliest of the others.

    Parameters
    ----------
    counts : (n_tags,) in how many cycles each tag was read.
    chances : (n_tags,) chance of each at the pose in question.
    most : k', tags that count in all.
    """
    tags = np.arange(len(counts))
    by_count = np.lexsort((tags, -counts))
    n_read = min(int(np.count_nonzero(counts)), most)
    by_chance = np.lexsort((tags, -chances))
    others = by_chance[counts[by_chance] == 0][: most - n_read]
    return np.concatenate([by_count[:n_read], others])


def log_likelihood(
    detection: DetectionField, poses: np.ndarray, counts: np.ndarray, n_cycles: int, most: int | None = None
) -> np.ndarray:
    """Logarithm (n,) of the likelihood of one antenna's snapshot at antenna poses (n, 3) (eqs. 4, 8).

    Parameters
    ----------
    counts : (n_tags,) in how many of `n_cycles` cycles each tag was read.
    most : k'; None: all tags count (eq. 7).
    """
    counts = np.asarray(counts)
    most = len(counts) if most is None else min(most, len(counts))
    chances = np.clip(detection.read_probability(poses).astype(float), 1e-12, 1 - 1e-12)
    logs = np.empty(len(chances))
    for i, row in enumerate(chances):
        tags = weighed_tags(counts, row, most)
        logs[i] = binomial_log(row[tags], counts[tags], n_cycles).sum()
    return logs


def binomial_log(q: np.ndarray, f: np.ndarray, n: int) -> np.ndarray:
    """Logarithm of the chance to read a tag f times in n cycles that each read it with chance q (eq. 4)."""
    ways = gammaln(n + 1) - gammaln(f + 1) - gammaln(n - f + 1)
    return ways + f * np.log(q) + (n - f) * np.log1p(-q)
