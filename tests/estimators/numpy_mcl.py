"""Monte-Carlo localization in plain numpy: the twin that the compiled filter is held against.

Algorithm 1 of hf_multireader_mcl as `rfiddesign.estimators.mcl` states it, with numpy's random numbers and the C
library's functions, in any precision: in float64 the reference of the tests, in float32 the peer of the benchmarks.
"""

import numpy as np

from rfiddesign.estimators.verbs import Filter
from rfiddesign.models.recording import Recording


class NumpyMcl:
    """The filter on one recording; arrays are kept from step to step, so that a step takes little memory.

    Parameters
    ----------
    ready : the filter made ready for the robot, its noise the same in every step.
    start : (3,) known pose [mm, mm, rad].
    rng : source of all randomness.
    dtype : np.float64 or np.float32.
    """

    def __init__(self, ready: Filter, start: np.ndarray, rng: np.random.Generator, dtype: type = np.float64):
        m, self.positions_mm, self.whitening, noise, self.rules, *_ = ready.model
        self.rng, self.dtype = rng, dtype
        self.x, self.y, self.heading = (np.full(m, value, dtype) for value in start)
        self.noise, self.room = np.empty((3, m), dtype), np.empty((4, m), dtype)
        self.ranks = np.arange(m, dtype=dtype)
        self.deviations = np.sqrt(noise[:, 0]).astype(dtype)[:, None]

    def predict(self, increment: np.ndarray) -> None:
        """Line 3."""
        noise, room = self.noise, self.room
        self.rng.standard_normal(dtype=self.dtype, out=noise)
        noise *= self.deviations
        noise += increment.astype(self.dtype)[:, None]
        np.cos(self.heading, out=room[0])
        np.sin(self.heading, out=room[1])
        self.x += np.multiply(room[0], noise[0], out=room[2])
        self.x -= np.multiply(room[1], noise[1], out=room[2])
        self.y += np.multiply(room[1], noise[0], out=room[2])
        self.y += np.multiply(room[0], noise[1], out=room[2])
        self.heading += noise[2]

    def update(self, antenna: np.ndarray, tags: np.ndarray) -> np.ndarray:
        """Lines 4 to 13; returns the estimate in the columns of `mcl.N_ESTIMATE`."""
        cosine, sine = np.cos(self.heading, out=self.room[0]), np.sin(self.heading, out=self.room[1])
        log_weights = self._log_weights(antenna, tags, cosine, sine)
        weights = np.exp(log_weights - log_weights.max())
        total = weights.sum()
        estimate = self._estimate(weights, total, cosine, sine)
        if len(antenna):
            self._resample(weights, total, log_weights, antenna, tags)
        return estimate

    def _log_weights(self, antenna: np.ndarray, tags: np.ndarray, cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
        log_weights = np.zeros(self.x.size, self.dtype)
        inner, tail = self.rules[:2].astype(self.dtype)
        for a, (tag_x, tag_y) in zip(antenna, tags.astype(self.dtype), strict=True):
            at_x, at_y = self.positions_mm[a].astype(self.dtype)
            whitening = self.whitening[a].astype(self.dtype)
            dx, dy = tag_x - self.x, tag_y - self.y
            u = cosine * dx + sine * dy - at_x
            v = cosine * dy - sine * dx - at_y
            p, q = whitening[0, 0] * u + whitening[0, 1] * v, whitening[1, 0] * u + whitening[1, 1] * v
            squared = p * p + q * q
            log_weights += np.where(squared < inner * inner, self.dtype(0), tail - self.dtype(0.5) * squared)
        return log_weights

    def _estimate(self, weights: np.ndarray, total: float, cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
        dx, dy = self.x - self.x[0], self.y - self.y[0]
        mean_x, mean_y = weights @ dx / total, weights @ dy / total
        heading = np.arctan2(weights @ sine, weights @ cosine)
        turn = self.heading - heading
        turn -= self.dtype(2 * np.pi) * np.round(turn / self.dtype(2 * np.pi))
        offsets = np.stack([dx - mean_x, dy - mean_y, turn])
        covariance = (offsets * weights) @ offsets.T / total
        effective = total * total / (weights @ weights)
        pose = (float(self.x[0]) + float(mean_x), float(self.y[0]) + float(mean_y), heading)
        return np.array([*pose, *covariance[np.triu_indices(3)][[0, 1, 3, 2, 4, 5]], effective])

    def _resample(
        self, weights: np.ndarray, total: float, log_weights: np.ndarray, antenna: np.ndarray, tags: np.ndarray
    ) -> None:
        m = self.x.size
        marks = (self.ranks + self.dtype(self.rng.random())) * (total / m)
        drawn = np.minimum(np.searchsorted(np.cumsum(weights), marks, side="right"), m - 1)
        self.x, self.y, self.heading = self.x[drawn], self.y[drawn], self.heading[drawn]
        lost = np.flatnonzero(log_weights[drawn] < self.rules[2])
        if lost.size:
            read = lost % len(antenna)
            heading = self.rng.uniform(-np.pi, np.pi, lost.size).astype(self.dtype)
            at, tag = self.positions_mm[antenna[read]], tags[read]
            self.heading[lost] = heading
            self.x[lost] = tag[:, 0] - (np.cos(heading) * at[:, 0] - np.sin(heading) * at[:, 1])
            self.y[lost] = tag[:, 1] - (np.sin(heading) * at[:, 0] + np.cos(heading) * at[:, 1])


def track(twin: NumpyMcl, recording: Recording, first: int, last: int, estimates: np.ndarray) -> None:
    """Run the twin over steps first..last-1; `estimates` as in `mcl.track`.  Reads are taken as fresh."""
    for t in range(first, last):
        twin.predict(recording.odometry[t])
        rows = slice(recording.read_start[t], recording.read_start[t + 1])
        estimates[t + 1] = twin.update(recording.read_antenna[rows], recording.read_tag_mm[rows])
