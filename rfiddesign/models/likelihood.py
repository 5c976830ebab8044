"""Likelihood of a read tag given where the antenna is (hf_multireader_mcl, section 5.2)."""

import math
from dataclasses import dataclass

import numpy as np

from rfiddesign import require
from rfiddesign.geometry import DetectionArea

LIKELIHOODS = ("gaussian", "combination")


@dataclass(frozen=True)
class DistanceLikelihood:
    """Weight of a read by the distance d between the antenna and the tag that it read.

    "gaussian": exp(-d^2 / (2 sigma^2)).  "combination" (eq. 6): 1 where d < sigma, beta exp(-d^2 / (2 sigma^2))
    elsewhere.  sigma is `sigma_per_radius` times the radius of the detection area.  For an area that is not a disc the
    distance is measured in units of its spread along each axis, such that a disc gives eq. 6 to the letter.

    Parameters
    ----------
    kind : "gaussian" or "combination".
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
        (n, 2, 2) array [1/mm].
        """
        # A uniform disc of radius r has variance r^2/4 per axis, hence the factor 2.
        values, axes = np.linalg.eigh(np.asarray(area.covariance_mm2))
        root = axes @ np.diag(1.0 / (2.0 * self.sigma_per_radius * np.sqrt(values))) @ axes.T
        cosine, sine = np.cos(yaws), np.sin(yaws)
        to_antenna = np.array([[cosine, sine], [-sine, cosine]]).transpose(2, 0, 1)
        return root @ to_antenna
