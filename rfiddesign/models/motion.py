"""Motion of the robot and what its odometry says of it."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rfiddesign import require

_MM_PER_M = 1e3


class Motion(Protocol):
    """Noise of an odometry: what every model of it offers."""

    def noise(self, dt_s: float) -> np.ndarray:
        """Variances of one step's increment (x [mm^2], y [mm^2], heading [rad^2]), shape (3, 3).

        Column 0 counts per step of `dt_s` seconds, column 1 per mm of way, column 2 per rad of turn.
        """
        ...


@dataclass(frozen=True)
class OmnidirectionalMotion:
    """White noise on the velocity of an omnidirectional robot (hf_multireader_mcl, eq. 1).

    Each step of duration dt moves the pose by (V + e) dt with e ~ N(0, sigma) drawn afresh; V in the robot's frame.

    Parameters
    ----------
    noise_x_mm_per_s, noise_y_mm_per_s : standard deviation of the velocity noise along the robot's axes [mm/s].
    noise_heading_rad_per_s : standard deviation of the turn-rate noise [rad/s].
    """

    noise_x_mm_per_s: float = 25.0
    noise_y_mm_per_s: float = 25.0
    noise_heading_rad_per_s: float = 0.05

    def __post_init__(self) -> None:
        for name in ("noise_x_mm_per_s", "noise_y_mm_per_s", "noise_heading_rad_per_s"):
            require.within(name, getattr(self, name), low=0.0, high=1e6)

    def noise(self, dt_s: float) -> np.ndarray:
        """See `Motion.noise`; the same in every step."""
        per_s = np.array([self.noise_x_mm_per_s, self.noise_y_mm_per_s, self.noise_heading_rad_per_s])
        rates = np.zeros((3, 3))
        rates[:, 0] = (per_s * dt_s) ** 2
        return rates


@dataclass(frozen=True)
class MecanumMotion:
    """Noise that grows with the way of a robot on Mecanum wheels: variances in proportion to way and turn.

    Rollers slip more sideways than forward, hence the two axes (rssi_kalman_navifloor, section V-C).

    Parameters
    ----------
    noise_x_mm_per_sqrt_m, noise_y_mm_per_sqrt_m : noise forward and sideways [mm per square root of a metre].
    noise_heading_rad_per_sqrt_m : noise of the heading from the way [rad per square root of a metre].
    noise_heading_rad_per_sqrt_rad : noise of the heading from turns [rad per square root of a radian].
    """

    noise_x_mm_per_sqrt_m: float = 12.0
    noise_y_mm_per_sqrt_m: float = 12.0
    noise_heading_rad_per_sqrt_m: float = 0.0087
    noise_heading_rad_per_sqrt_rad: float = 0.03

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            require.within(name, getattr(self, name), low=0.0, high=1e6)

    def noise(self, dt_s: float) -> np.ndarray:
        """See `Motion.noise`."""
        per_m = np.array([self.noise_x_mm_per_sqrt_m, self.noise_y_mm_per_sqrt_m, self.noise_heading_rad_per_sqrt_m])
        rates = np.zeros((3, 3))
        rates[:, 1] = per_m**2 / _MM_PER_M
        rates[2, 2] = self.noise_heading_rad_per_sqrt_rad**2
        return rates


@dataclass(frozen=True)
class DifferentialMotion:
    """Noise of two driven wheels, each with a variance in proportion to its way (Siegwart, Nourbakhsh, eq. 5.13).

    With k the variance per mm of a wheel and b the track, a step of way d and turn phi moves the wheels by 2 d + b phi
    in all (at most): variance k (2 d + b phi) / 4 forward and k (2 d + b phi) / b^2 of the heading; none sideways.

    Parameters
    ----------
    wheel_noise_mm_per_sqrt_m : noise of a wheel's way [mm per square root of a metre].
    track_mm : distance between the wheels [mm].
    """

    wheel_noise_mm_per_sqrt_m: float = 10.0
    track_mm: float = 400.0

    def __post_init__(self) -> None:
        require.within("wheel_noise_mm_per_sqrt_m", self.wheel_noise_mm_per_sqrt_m, low=0.0, high=1e6)
        require.within("track_mm", self.track_mm, low=10.0, high=1e5)

    def noise(self, dt_s: float) -> np.ndarray:
        """See `Motion.noise`."""
        k, b = self.wheel_noise_mm_per_sqrt_m**2 / _MM_PER_M, self.track_mm
        rates = np.zeros((3, 3))
        rates[0, 1:] = k / 2, k * b / 4
        rates[2, 1:] = 2 * k / b**2, k / b
        return rates


@dataclass(frozen=True)
class OdometryFaults:
    """What is systematically wrong with an odometry, and how often its wheels slip.

    Parameters
    ----------
    scale_x, scale_y : relative error of measured ways forward and sideways; 0.01 reports 1 % too much.
    drift_rad_per_m : turn that the odometry reports beyond the true one, per metre of way [rad/m].
    slips_per_m : mean number of slips of a wheel per metre of way.
    slip_mm, slip_rad : standard deviations of what a slip adds to the reported way (ahead) and turn.
    """

    scale_x: float = 0.0
    scale_y: float = 0.0
    drift_rad_per_m: float = 0.0
    slips_per_m: float = 0.0
    slip_mm: float = 0.0
    slip_rad: float = 0.0

    def __post_init__(self) -> None:
        for name in ("scale_x", "scale_y"):
            require.within(name, getattr(self, name), low=-0.5, high=0.5)
        require.within("drift_rad_per_m", self.drift_rad_per_m, low=-10.0, high=10.0)
        for name, most in (("slips_per_m", 1e3), ("slip_mm", 1e4), ("slip_rad", math.pi)):
            require.within(name, getattr(self, name), low=0.0, high=most)

    @property
    def compiled(self) -> tuple[float, ...]:
        """The faults for compiled code, ways in mm."""
        return (
            float(self.scale_x), float(self.scale_y), self.drift_rad_per_m / _MM_PER_M, self.slips_per_m / _MM_PER_M,
            float(self.slip_mm), float(self.slip_rad),
        )  # fmt: skip
