"""The likelihood of a snapshot, evaluated directly from a detection field (uhf_snapshots, eqs. 4 and 7 to 9)."""

import numpy as np
from scipy.special import gammaln

from rfiddesign.estimators.snapshot._likelihood_kernels import truncated_logs
from rfiddesign.models.detection_field import DetectionField


def log_likelihood(
    detection: DetectionField, poses: np.ndarray, counts: np.ndarray, n_cycles: int, most: int | None = None
) -> np.ndarray:
    """Logarithm (n,) of the likelihood of one antenna's snapshot at antenna poses (n, 3) (eqs. 4, 8).

    The tags that count (eq. 9) are those read, most often first, and the likeliest of the others.

    Parameters
    ----------
    counts : (n_tags,) in how many of `n_cycles` cycles each tag was read.
    most : k', tags that count; None: all of them (eq. 7).

    Raises
    ------
    ValueError : if the counts are not of the field's tags or beyond the cycles.
    """
    counts = np.ascontiguousarray(counts, np.int64)
    if counts.shape != (detection.n_tags,):
        raise ValueError(f"counts has shape {counts.shape}, must be ({detection.n_tags},)")
    if counts.min() < 0 or counts.max() > n_cycles:
        raise ValueError(f"counts: holds {counts.min()} to {counts.max()}, must be within 0 to {n_cycles}")
    most = len(counts) if most is None else min(most, len(counts))
    chances = np.ascontiguousarray(detection.read_probability(poses), np.float32)
    logs = np.empty(len(chances))
    truncated_logs(chances, counts, n_cycles, most, log_ways(n_cycles), logs)
    return logs


def log_ways(n: int) -> np.ndarray:
    """Logarithms (n + 1,) of the ways in which a tag is read 0, 1, ... n times in n cycles."""
    f = np.arange(n + 1.0)
    return gammaln(n + 1) - gammaln(f + 1) - gammaln(n - f + 1)


def binomial_logs(q: np.ndarray, n: int) -> np.ndarray:
    """Logarithm (len(q), n + 1) of the chance to read a tag 0 to n times in n cycles, by its chance in one (eq. 4)."""
    f, q = np.arange(n + 1), np.asarray(q, float)[:, None]
    return log_ways(n) + f * np.log(q) + (n - f) * np.log1p(-q)
