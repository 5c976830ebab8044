"""What tells how likely an antenna at a pose reads each tag: a true world, or what was learned of one."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class DetectionField(Protocol):
    """Chance of each tag to be read, over the poses of an antenna.

    Simulated drives read from one, estimators weigh particles by one: either may be given any.
    """

    @property
    def n_tags(self) -> int:
        """How many tags there are."""
        ...

    def read_probability(self, antenna_poses: NDArray[np.float64]) -> NDArray[np.float32]:
        """Chance (n, n_tags) that an antenna at each pose (n, 3) (x, y [mm], boresight [rad]) reads each tag in one
        inquiry cycle.
        """
        ...
