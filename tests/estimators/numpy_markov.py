"""Markov localization on a grid in plain numpy: the twin that the compiled filter is held against.

The belief that `rfiddesign.estimators.markov` describes, by matrices: the covariance of the pose by F P F', the blur's
directions by trying all, each blur step by step, eq. 10 on the whole grid.
"""

import itertools
from functools import cache

import numpy as np

from rfiddesign.estimators.verbs import Filter

MOST_VARIANCE, RATIO, DUE = 5.0, 64.0, 4.0


class NumpyMarkov:
    """The filter from a known pose (3,) with a small covariance (3, 3)."""

    def __init__(self, ready: Filter, pose: np.ndarray, covariance: np.ndarray):
        self.settings, self.dt_s = ready.settings, ready.dt_s
        _, self.places, self.noise, self.variance, _, _, self.baseline, self.is_compensated, self.delay = ready.model
        n, self.cell = ready.settings.n_cells, ready.settings.cell_mm
        self.steps = (np.arange(n) - n // 2) * self.cell
        self.grid = np.zeros((n, n))
        self.grid[n // 2, n // 2] = 1.0
        self.middle, self.heading = np.array(pose[:2], float), float(pose[2])
        # Covariance of the pose without what the grid holds.
        self.due = np.array(covariance, float)
        self.reference = None

    @property
    def points(self):
        """Places of all cells (n, n, 2)."""
        x, y = np.meshgrid(self.middle[0] + self.steps, self.middle[1] + self.steps)
        return np.stack([x, y], axis=-1)

    @property
    def moments(self):
        """Mean and covariance of the grid."""
        points, masses = self.points, self.grid / self.grid.sum()
        mean = np.einsum("ij,ijk->k", masses, points)
        return mean, np.einsum("ij,ijk,ijl->kl", masses, points - mean, points - mean)

    @property
    def pose(self):
        return np.array([*self.moments[0], self.heading])

    @property
    def covariance(self):
        total = self.due.copy()
        total[:2, :2] += self.moments[1]
        for k in range(2):
            total[k, k] = max(total[k, k], self.cell**2 / 12)
        return total

    def predict(self, increment):
        c, s = np.cos(self.heading), np.sin(self.heading)
        turn = np.array([[c, -s], [s, c]])
        way = turn @ increment[:2]
        moved = np.eye(3)
        moved[:2, 2] = -way[1], way[0]
        rates = self.noise @ [1.0, np.hypot(*increment[:2]), abs(increment[2])]
        added = np.zeros((3, 3))
        added[:2, :2] = turn @ np.diag(rates[:2]) @ turn.T
        added[2, 2] = rates[2]
        self.due = moved @ self.due @ moved.T + added
        self.middle += way
        self.heading += increment[2]
        if self.reference is not None:
            self.reference["way"] = self.reference["way"] + way

    def update(self, antennas, tags, increment, ages):
        if len(tags):
            self._use(antennas, np.asarray(tags, float), increment, ages)
        if self.due[[0, 1], [0, 1]].max() > DUE * self.cell**2:
            self._blur()

    def _use(self, antennas, tags, increment, ages):
        for _ in range(8):
            values, vectors = np.linalg.eigh(self.due[:2, :2])
            self.due[:2, :2] = (vectors * np.maximum(values, 0)) @ vectors.T
            if np.trace(self.due[:2, :2]) < 1e-9 * self.cell**2:
                break
            self._blur()
        before = self.moments[1]
        c, s = np.cos(self.heading), np.sin(self.heading)
        logs, precision = 0.0, 0.0
        for antenna, tag, age in zip(antennas, tags, ages, strict=True):
            place = self._then(self.places[antenna], increment, age / self.dt_s + self.delay)
            precision_one = 1.0 / (self.variance + self.due[2, 2] * place @ place)
            distance = np.linalg.norm(self.points + np.array([[c, -s], [s, c]]) @ place - tag, axis=-1)
            logs = logs - 0.5 * precision_one * distance**2
            precision += precision_one
        assert precision < 4 / self.cell**2, "the twin has no least width"
        self.grid = self.grid * np.exp(logs - logs.max())
        self.grid /= self.grid.sum()
        mean, after = self.moments
        cells = np.round((mean - self.middle) / self.cell).astype(int)
        n = len(self.grid)
        padded = np.pad(self.grid, n)
        self.grid = padded[n + cells[1] : 2 * n + cells[1], n + cells[0] : 2 * n + cells[0]]
        self.middle = self.middle + cells * self.cell
        own = self.cell**2 / 12 * np.eye(2)
        self.due[:2, 2] = (after + own) @ np.linalg.solve(before + own, self.due[:2, 2])
        self.due[2, :2] = self.due[:2, 2]
        if self.settings.corrects_heading:
            self._correct(tags[-1])

    def _then(self, place, increment, back):
        if not self.is_compensated or back <= 0:
            return place

        def turned(angle):
            return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

        at_begin = turned((1 - back) * increment[2]) @ place + (1 - back) * increment[:2]
        return turned(-increment[2]) @ (at_begin - increment[:2])

    def _correct(self, tag):
        mean, covariance = self.moments
        new = {"mean": mean, "covariance": covariance, "tag": tag, "way": np.zeros(2)}
        if self.reference is not None:
            way, moved = self.reference["way"], mean - self.reference["mean"]
            if np.array_equal(tag, self.reference["tag"]) or np.linalg.norm(way) < self.baseline:
                return
            length = np.linalg.norm(moved)
            across = np.array([-moved[1], moved[0]]) / length
            spread = across @ (covariance + self.reference["covariance"]) @ across + self.cell**2 / 6
            error = np.angle(complex(*moved) / complex(*way))
            gain = self.due[2, 2] / (self.due[2, 2] + np.arctan(np.sqrt(spread) / length) ** 2)
            self.heading += gain * error
            self.due[2, 2] *= 1 - gain
            self.due[:2, 2] *= np.sqrt(1 - gain)
            self.due[2, :2] = self.due[:2, 2]
        self.reference = new

    def _blur(self):
        values, vectors = np.linalg.eigh(self.due[:2, :2] / self.cell**2)
        if values[1] <= 0:
            return
        wanted = (vectors * np.maximum(values, values[1] / RATIO)) @ vectors.T
        for direction, variance in directions(wanted):
            variance = min(variance, MOST_VARIANCE)
            n_steps = max(int(np.ceil(2 * variance - 1e-12)), 1)
            for _ in range(n_steps):
                near = shifted(self.grid, direction) + shifted(self.grid, -direction) - 2 * self.grid
                self.grid = self.grid + 0.5 * variance / n_steps * near
            self.due[:2, :2] -= self.cell**2 * variance * np.outer(direction, direction)


@cache
def bases():
    """All bases of the whole numbers' lattice with short vectors, and the vector that closes each: (n, 3, 2)."""
    span = np.arange(-9, 10)
    all_vectors = np.array(list(itertools.product(span, span)))
    determinant = all_vectors[:, None, 0] * all_vectors[None, :, 1] - all_vectors[:, None, 1] * all_vectors[None, :, 0]
    first, second = np.nonzero(determinant == 1)
    a, b = all_vectors[first], all_vectors[second]
    return np.stack([a, b, -a - b], axis=1).astype(float)


def directions(matrix):
    """Whole vectors e and weights w >= 0 whose sum of w e e' is the matrix (2, 2), found among all that are short."""
    products = np.einsum("nik,kl,njl->nij", bases(), matrix, bases())
    worst = products[:, [0, 0, 1], [1, 2, 2]].max(axis=1)
    best = np.argmin(worst)
    assert worst[best] <= 1e-9, "no short directions"
    pairs = -products[best, [1, 0, 0], [2, 2, 1]]
    return [(np.array([-v[1], v[0]]), max(w, 0.0)) for v, w in zip(bases()[best], pairs, strict=True)]


def shifted(grid, direction):
    """The grid moved by whole cells (x, y); what leaves is lost."""
    x, y = (int(value) for value in direction)
    n = len(grid)
    return np.pad(grid, n)[n - y : 2 * n - y, n - x : 2 * n - x]
