"""Likelihood of a read tag given where the antenna is (hf_multireader_mcl, section 5.2)."""

import math
from dataclasses import dataclass

import numpy as np

from rfiddesign import require
from rfiddesign.geometry import DetectionArea
from rfiddesign.models.read_field import tabulated

LIKELIHOODS = ("gaussian", "combination", "field")
# Least read probability that a filter believes in, of the "field" likelihood.
_LEAST_PROBABILITY = 1e-3


@dataclass(frozen=True)
class DistanceLikelihood:
    """Weight of a read by the distance d between the antenna and the tag that it read.

    "gaussian": exp(-d^2 / (2 sigma^2)).  "combination" (eq. 6): 1 where d < sigma, beta exp(-d^2 / (2 sigma^2))
    elsewhere.  sigma is `sigma_per_radius` times the radius of the detection area.  For an area that is not a disc the
    distance is measured in units of its spread along each axis, such that a disc gives eq. 6 to the letter.  "field":
    the read probability of the detection field itself at the tag's place, at least 0.001.

    Parameters
    ----------
    kind : "gaussian", "combination" or "field"; sigma and beta are of the first two.
    sigma_per_radius : sigma over the radius on the floor.  The combination model wins only between 0.85 and 1.5.
    beta : weight of the tail of the combination model.
    """

    kind: str = "combination"
    sigma_per_radius: float = 1.1
    beta: float = 0.3

    def __post_init__(self) -> None:
        if self.kind not in LIKELIHOODS:
            raise ValueError(f"likelihood is {self.kind!r}, must be one of {', '.join(LIKELIHOODS)}")
        require.within("sigma_per_radius", self.sigma_per_radius, low=0.01, high=100.0)
        require.within("beta", self.beta, low=0.0, high=1.0, is_low_open=True)

    @property
    def inner_radius(self) -> float:
        """Distance in sigmas within which the weight is exactly 1."""
        return 1.0 if self.kind == "combination" else 0.0

    @property
    def log_tail(self) -> float:
        """Logarithm of the factor of the Gaussian outside the inner radius."""
        return math.log(self.beta) if self.kind == "combination" else 0.0

    def whitening(self, area: DetectionArea, yaws: np.ndarray) -> np.ndarray:
        """Matrices W such that |W z| is the distance in sigmas of a tag at z, robot axes from the antenna's centre.

        Parameters
        ----------
        area : what one antenna sees of the floor.
        yaws : orientation of each antenna on the robot, shape (n,) [rad].

        Returns
        -------
        (n, 2, 2) array [1/mm]; for "field" the rotations to the antennas' axes.
        """
        cosine, sine = np.cos(yaws), np.sin(yaws)
        to_antenna = np.array([[cosine, sine], [-sine, cosine]]).transpose(2, 0, 1)
        if self.kind == "field":
            return to_antenna
        # A uniform disc of radius r has variance r^2/4 per axis, hence the factor 2.
        values, axes = np.linalg.eigh(np.asarray(area.covariance_mm2))
        if values[1] - values[0] <= 1e-9 * values[1]:
            # Turning changes no distance.
            return np.broadcast_to(np.eye(2) / (2.0 * self.sigma_per_radius * math.sqrt(values[1])), (yaws.size, 2, 2))
        root = axes @ np.diag(1.0 / (2.0 * self.sigma_per_radius * np.sqrt(values))) @ axes.T
        return root @ to_antenna

    def log_table(self, area: DetectionArea) -> tuple[np.ndarray, float]:
        """Logarithm of the likelihood in cells about the antenna, (n, m) float32, and the side of a cell [mm].

        Only "field" has one; the table of the others has no cells.  Its border lies outside the field.
        """
        if self.kind != "field":
            return np.zeros((0, 0), np.float32), 1.0
        probability, cell_mm = tabulated(area)
        return np.log(
            np.pad(np.maximum(probability, _LEAST_PROBABILITY), 1, constant_values=_LEAST_PROBABILITY)
        ), cell_mm
