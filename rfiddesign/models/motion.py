"""Motion of the robot and what its odometry says of it."""

from dataclasses import dataclass

from rfiddesign import require


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

    def step_deviations(self, dt_s: float) -> tuple[float, float, float]:
        """Standard deviations (x [mm], y [mm], heading [rad]) of the noise of one step of `dt_s` seconds."""
        return (
            self.noise_x_mm_per_s * dt_s,
            self.noise_y_mm_per_s * dt_s,
            self.noise_heading_rad_per_s * dt_s,
        )
