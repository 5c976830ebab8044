"""Read fields whose contours keep their shape: at twice the communication distance, twice as large."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from rfiddesign import require
from rfiddesign.models.log_field import LogField, log_field_of

SHAPES = ("ellipse", "sector")
_TABLE_CELLS_PER_SIDE = 1000


@dataclass(frozen=True)
class Lobe:
    """What an antenna that looks along its x axis needs to be set to, to read a tag, and with which chance it reads.

    "ellipse": contours of equal signal are ellipses with one end of their long axis at the antenna, as the ranges of
    tag_mapping_adaptive_likelihood are.  "sector": the signal falls as G^2 / r^4 with the gain G of a beam, a power of
    the cosine, so that (eq. 2 there) the distance needed is r / sqrt(G).  Nothing is read behind the antenna.

    Parameters
    ----------
    shape : "ellipse" or "sector".
    ratio : short axis of an ellipse over its long one.
    beam_deg : width of a sector between the directions with half the gain [deg].
    softness : standard deviation of the logarithm of the distance needed, which differs from read to read; 0: a tag is
        read whenever it is within the contour.
    read_probability : chance to be read far within it.
    """

    shape: str = "ellipse"
    ratio: float = 7 / 20
    beam_deg: float = 70.0
    softness: float = 0.0
    read_probability: float = 1.0

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise ValueError(f"shape is {self.shape!r}, must be one of {', '.join(SHAPES)}")
        require.within("ratio", self.ratio, low=0.01, high=100.0)
        require.within("beam_deg", self.beam_deg, low=1.0, high=179.0)
        require.within("softness", self.softness, low=0.0, high=10.0)
        require.within("read_probability", self.read_probability, low=0.0, high=1.0)

    def needed_mm(self, places: ArrayLike) -> np.ndarray:
        """Communication distance [mm] whose contour goes through places (..., 2) [mm], infinite behind the antenna."""
        u, v = np.moveaxis(np.asarray(places, float), -1, 0)
        ahead = np.where(u > 0, u, 1.0)
        if self.shape == "ellipse":
            needed = ahead + (v / self.ratio) ** 2 / ahead
        else:
            r = np.hypot(ahead, v)
            power = math.log(0.5) / math.log(math.cos(math.radians(self.beam_deg / 2)))
            needed = r * (r / ahead) ** (0.5 * power)
        return np.where(u > 0, needed, np.inf)

    def probability(self, places: ArrayLike, distance_mm: ArrayLike) -> np.ndarray:
        """Chance to read a tag at places (..., 2) [mm] while the reader is set to a communication distance [mm]."""
        needed = self.needed_mm(places)
        if self.softness == 0:
            return self.read_probability * (needed <= distance_mm)
        with np.errstate(divide="ignore"):
            return self.read_probability * ndtr(np.log(distance_mm / needed) / self.softness)

    def log_field(self, distances_mm: tuple[float, ...], cell_mm: float) -> LogField:
        """What polls say that try these distances, rising, until the tag is read; see `log_field_of`.

        Raises
        ------
        ValueError : if the lobe reads with certainty, or is too large for cells of this size.
        """
        reach = distances_mm[-1] * math.exp(3.0 * self.softness)
        if reach / require.positive("cell_mm", cell_mm) > _TABLE_CELLS_PER_SIDE:
            raise ValueError(
                f"cell_mm is {cell_mm!r}, must be at least {reach / _TABLE_CELLS_PER_SIDE:g} for this lobe"
            )
        n = math.ceil(reach / cell_mm)
        u, v = (np.arange(n) + 0.5) * cell_mm, (np.arange(2 * n + 1) - n) * cell_mm
        places = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
        powers = [self.probability(places, distance) for distance in distances_mm]
        # Nothing is read where the chance is below that of an odd read.
        powers = np.where(np.stack(powers) < 1e-4, 0.0, powers)
        return log_field_of(powers, cell_mm, (u[0], v[0]))
