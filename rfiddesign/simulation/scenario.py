"""A scenario: how designs are exercised, and what the world does to them."""

from dataclasses import dataclass, field

from rfiddesign import require
from rfiddesign.estimators.mcl import Mcl, motion_noise
from rfiddesign.estimators.registry import Settings
from rfiddesign.floor import Floor
from rfiddesign.models.motion import Motion, OdometryFaults, OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.simulation.fixed_route import FixedRoute
from rfiddesign.simulation.network_drive import NetworkDrive
from rfiddesign.simulation.trajectory import HEADINGS, check_manner

STARTS = ("known", "unknown", "two_tags")
MAX_STEPS = 200_000


@dataclass(frozen=True)
class Routes:
    """Where and how the robots drive.  Each run draws its route, speed and manner of heading anew.

    Parameters
    ----------
    speeds_mm_per_s : speeds, drawn with equal chance [mm/s].
    aligned_share : share of runs that drive along the axes of the tag lattice; the others drive obliquely.
    headings : manners of heading, drawn with equal chance: "along" faces the way and turns in place at corners,
        "constant" holds one heading (a multiple of 90 degrees on aligned routes).
    turn_rate_rad_per_s : speed of turns in place [rad/s].
    """

    speeds_mm_per_s: tuple[float, ...] = (100.0, 200.0, 300.0)
    aligned_share: float = 0.5
    headings: tuple[str, ...] = HEADINGS
    turn_rate_rad_per_s: float = 1.0

    def __post_init__(self) -> None:
        check_manner(self.speeds_mm_per_s, self.headings, self.turn_rate_rad_per_s)
        require.within("aligned_share", self.aligned_share, low=0.0, high=1.0)


@dataclass(frozen=True)
class World:
    """What is true, whatever the estimator believes.

    Parameters
    ----------
    motion : noise of the odometry.
    reads : how the readers read.
    installation_error_mm : standard deviation per axis of where a tag lies about where the map has it [mm]; every run
        meets a freshly laid floor.
    faults : what is systematically wrong with the odometry.
    dead_share : share of the tags that never answer; which ones is drawn for each tag of each run's floor on its own.
    field_scale : size of the true detection fields, RSSI rings included, over that in the catalogue, which the
        estimator believes.
    """

    motion: Motion = field(default_factory=OmnidirectionalMotion)
    reads: ReadModel = field(default_factory=ReadModel)
    installation_error_mm: float = 0.0
    faults: OdometryFaults = field(default_factory=OdometryFaults)
    dead_share: float = 0.0
    field_scale: float = 1.0

    def __post_init__(self) -> None:
        require.within("installation_error_mm", self.installation_error_mm, low=0.0, high=1000.0)
        require.within("dead_share", self.dead_share, low=0.0, high=1.0)
        require.within("field_scale", self.field_scale, low=0.5, high=2.0)


@dataclass(frozen=True)
class Scenario:
    """How a design is exercised.

    Parameters
    ----------
    floor : where tags lie and robots drive.
    routes, world : see there.
    estimator : the filter on the robot.
    start : "known": the filter starts at the true pose; "unknown": anywhere in the box around the
        floor's navigable part, with any heading; "two_tags": it starts once a second tag was read, with the pose that
        the two tell (see `estimators.acquisition`), and only from then on errors count.
    duration_s, dt_s : length of a run and of a filter step [s].
    settle_s : errors count from here on [s].
    is_delay_known : whether the filter is told by how much reads are late.
    start_offset : (x [mm], y [mm], heading [rad]) by which a known start is wrong.
    """

    floor: Floor
    routes: Routes | FixedRoute | NetworkDrive = field(default_factory=Routes)
    world: World = field(default_factory=World)
    estimator: Settings = field(default_factory=Mcl)
    start: str = "known"
    duration_s: float = 60.0
    dt_s: float = 0.05
    settle_s: float = 0.0
    is_delay_known: bool = False
    start_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.start not in STARTS:
            raise ValueError(f"start is {self.start!r}, must be one of {', '.join(STARTS)}")
        require.within("dt_s", self.dt_s, low=1e-4, high=10.0)
        require.within("duration_s", self.duration_s, low=self.dt_s, high=self.dt_s * MAX_STEPS)
        for whose, motion in (("world", self.world.motion), ("estimator", self.estimator.motion)):
            try:
                motion_noise(motion, self.dt_s)
            except ValueError as error:
                raise ValueError(f"{whose}: {error}") from None
        for name, offset in zip(("x", "y", "heading"), self.start_offset, strict=True):
            require.within(f"start_offset, {name}", offset, low=-1e5, high=1e5)
        require.within("settle_s", self.settle_s, low=0.0, high=self.duration_s - self.dt_s)

    @property
    def n_steps(self) -> int:
        """Filter steps of a complete run."""
        return round(self.duration_s / self.dt_s)

    @property
    def first_scored_step(self) -> int:
        """First step whose error counts."""
        return min(round(self.settle_s / self.dt_s), self.n_steps - 1)
