"""Drives from station to station along a network of routes, a little off them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.floor.route_network import RouteNetwork
from rfiddesign.numerics._math_kernels import atan2_64
from rfiddesign.numerics._noise_kernels import STREAM_MANNER, STREAM_ROUTE, fill_fine_uniform, step_key
from rfiddesign.simulation import _network_drive_kernels as kernels
from rfiddesign.simulation.trajectory import check_manner

# A leg has some length, so that a run ends; a network of shorter legs than this would need more of them.
MAX_LEGS = 10_000


@dataclass(frozen=True)
class NetworkDrive:
    """Where and how robots drive along routes.

    A run begins anywhere on the way from one station to another and goes on to further ones, all drawn.  On each leg
    the robot keeps to one side of the route and turned off it by an angle, both drawn anew for every leg and changed
    where it turns at the station.

    Parameters
    ----------
    network : the routes.
    speeds_mm_per_s : speeds, drawn for each run with equal chance [mm/s].
    headings : manners of heading, drawn for each run with equal chance: "along" faces the way and turns in place at
        corners, "constant" holds one heading, any.
    turn_rate_rad_per_s : speed of turns in place [rad/s].
    lateral_mm, yaw_rad : deviations from the route up to which each is equally likely, to either side [mm, rad].
    """

    network: RouteNetwork
    speeds_mm_per_s: tuple[float, ...] = (100.0, 200.0, 300.0)
    headings: tuple[str, ...] = ("along",)
    turn_rate_rad_per_s: float = 1.0
    lateral_mm: float = 50.0
    yaw_rad: float = math.radians(3.0)

    def __post_init__(self) -> None:
        check_manner(self.speeds_mm_per_s, self.headings, self.turn_rate_rad_per_s)
        require.within("lateral_mm", self.lateral_mm, low=0.0, high=10_000.0)
        require.within("yaw_rad", self.yaw_rad, low=0.0, high=math.pi)

    def poses(self, key: int, dt_s: float, n_steps: int) -> NDArray[np.float64]:
        """Poses (n_steps + 1, 3) of the run whose streams `key` names.

        Raises
        ------
        ValueError : if the routes are so short that a run would have more than 10,000 legs.
        """
        draws = _uniform(key, STREAM_MANNER, 0, 5)
        speed = self.speeds_mm_per_s[int(draws[0] * len(self.speeds_mm_per_s))]
        manner = self.headings[int(draws[1] * len(self.headings))]
        held = 2.0 * math.pi * draws[2] if manner == "constant" else math.nan
        milestones = self._milestones(key, (draws[3], draws[4]), speed, manner, dt_s * n_steps)
        poses = np.empty((n_steps + 1, 3))
        kernels.poses_between(milestones, held, float(dt_s), poses)
        return poses

    def _milestones(
        self, key: int, start: tuple[float, float], speed: float, manner: str, duration_s: float
    ) -> NDArray[np.float64]:
        """Rows (k, 6) as `poses_between` takes them, at every corner before and after the turn there."""
        n_stations = self.network.n_stations
        station, way = int(start[0] * n_stations), _Way(speed, self.turn_rate_rad_per_s, manner == "along")
        for leg in range(MAX_LEGS):
            draws = _uniform(key, STREAM_ROUTE, leg, 3)
            other = int(draws[0] * (n_stations - 1))
            other += other >= station
            line = self.network.path(station, other)
            deviation = (self.lateral_mm * (2.0 * draws[1] - 1.0), self.yaw_rad * (2.0 * draws[2] - 1.0))
            way.drive(line if leg else cut_before(line, start[1]), deviation)
            if way.time_s > duration_s:
                return np.array(way.milestones)
            station = other
        raise ValueError(
            f"duration_s is {duration_s:g}: the routes are too short, a run would have over {MAX_LEGS} legs"
        )


class _Way:
    """The way driven so far: milestones, and how the robot stands at the last of them."""

    def __init__(self, speed: float, turn_rate: float, is_along: bool):
        self.milestones: list[tuple[float, ...]] = []
        self.time_s = 0.0
        self._speed, self._turn_rate, self._is_along = speed, turn_rate, is_along
        self._direction = 0.0
        self._back: tuple[float, float] | None = None
        self._deviation = (0.0, 0.0)

    def drive(self, line: NDArray[np.float64], deviation: tuple[float, float]) -> None:
        """Drive a polyline (k, 2) off it by a lateral distance and an angle, which are taken up where it begins."""
        x, y = line[0].tolist()
        for next_x, next_y in line[1:].tolist():
            dx, dy = next_x - x, next_y - y
            length = math.sqrt(dx * dx + dy * dy)
            if length == 0.0:
                continue
            self._turn(x, y, (dx, dy), deviation)
            self.time_s += length / self._speed
            x, y = next_x, next_y
            self._mark(x, y)

    def _turn(self, x: float, y: float, leg: tuple[float, float], deviation: tuple[float, float]) -> None:
        """Turn at (x, y) into a leg, the short way round, as slowly as wheels and turn rate ask for."""
        if self._back is None:
            self._direction, self._deviation = atan2_64(leg[1], leg[0]), deviation
        else:
            (back_x, back_y), (ahead_x, ahead_y) = self._back, leg
            turn = atan2_64(back_x * ahead_y - back_y * ahead_x, back_x * ahead_x + back_y * ahead_y)
            lateral, yaw = (abs(new - old) for new, old in zip(deviation, self._deviation, strict=True))
            slide = lateral + abs(turn) * max(abs(deviation[0]), abs(self._deviation[0]))
            rotation = yaw + (abs(turn) if self._is_along else 0.0)
            self.time_s += max(slide / self._speed, rotation / self._turn_rate)
            self._direction += turn
            self._deviation = deviation
        self._back = leg
        self._mark(x, y)

    def _mark(self, x: float, y: float) -> None:
        self.milestones.append((self.time_s, x, y, self._direction, *self._deviation))


def cut_before(line: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """What is left of a polyline (k, 2) behind a share of its length below 1."""
    legs = np.sqrt((np.diff(line, axis=0) ** 2).sum(axis=1))
    reached = np.concatenate([[0.0], np.cumsum(legs)])
    at = share * reached[-1]
    k = min(int(np.searchsorted(reached, at, side="right")) - 1, len(legs) - 1)
    first = line[k] + (at - reached[k]) / max(legs[k], 1e-12) * (line[k + 1] - line[k])
    return np.concatenate([first[None], line[k + 1 :]])


def _uniform(key: int, stream: int, step: int, n: int) -> list[float]:
    draws = np.empty(n)
    fill_fine_uniform(np.uint64(step_key(key, stream, step)), draws)
    return draws.tolist()
