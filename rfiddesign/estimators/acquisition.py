"""The start of an estimator that is told nothing: the pose from the first two tags (rssi_kalman_navifloor, eq. 13)."""

import numpy as np

from rfiddesign.estimators import _acquisition_kernels as kernels
from rfiddesign.estimators.start import UncertainStart
from rfiddesign.models.recording import Recording
from rfiddesign.models.robot import Robot
from rfiddesign.models.shape import radius_of


def start_by_two_tags(recording: Recording, robot: Robot) -> tuple[int, UncertainStart] | None:
    """The step whose reads bring a second tag, and the pose after it; None if the recording has no two tags.

    Uncertainty of the odometry between the two tags is left out: it is small beside that of the reads.
    """
    search, pose, covariance = np.zeros(kernels.N_SEARCH), np.zeros(3), np.zeros((3, 3))
    positions, radius = robot.layout.poses_mm[:, :2], radius_of(robot.area)
    for t in range(recording.n_steps):
        kernels.advance(search, recording.odometry, t)
        for row in range(recording.read_start[t], recording.read_start[t + 1]):
            antenna = int(recording.read_antenna[row])
            x, y = positions[antenna]
            tag_x, tag_y = recording.read_tag_mm[row]
            if kernels.find_pose(search, antenna, x, y, tag_x, tag_y, radius, pose, covariance):
                return t, UncertainStart(tuple(pose.tolist()), tuple(map(tuple, covariance.tolist())))
    return None
