"""A route that every run drives, shifted or turned at random so that no run owes its luck to the tags' lattice."""

import math
from dataclasses import dataclass

import numpy as np

from rfiddesign import require
from rfiddesign.floor.plan import MAX_EXTENT_MM
from rfiddesign.numerics._math_kernels import atan2_64
from rfiddesign.numerics._noise_kernels import STREAM_PLACE, fill_fine_uniform, step_key
from rfiddesign.simulation.trajectory import drive

MAX_WAYPOINTS = 100_000
# Corners of a circle: its polygon stays within 4e-5 radii of it.
_CIRCLE_CORNERS = 360


@dataclass(frozen=True)
class FixedRoute:
    """A polyline driven at one speed.

    Parameters
    ----------
    waypoints_mm : corners of the route (x, y) [mm]; two or more.
    speed_mm_per_s : speed between them [mm/s].
    heading_rad : heading held all the way; None: the robot faces where it drives and turns in place at corners.
    turn_rate_rad_per_s : speed of these turns [rad/s].
    stay_s : how long the robot stands at every corner, the first and the last included, before it turns [s].
    shift_mm : each run shifts the route by up to half of this in x and in y, uniformly [mm].
    is_turned : each run turns route and heading about the route's middle by any angle, uniformly.
    """

    waypoints_mm: tuple[tuple[float, float], ...]
    speed_mm_per_s: float = 100.0
    heading_rad: float | None = None
    turn_rate_rad_per_s: float = 1.0
    stay_s: float = 0.0
    shift_mm: float = 0.0
    is_turned: bool = False

    def __post_init__(self) -> None:
        if not 2 <= len(self.waypoints_mm) <= MAX_WAYPOINTS:
            raise ValueError(f"waypoints_mm has {len(self.waypoints_mm)} corners, must be from 2 to {MAX_WAYPOINTS:,}")
        for point in self.waypoints_mm:
            if len(point) != 2:
                raise ValueError(f"waypoints_mm has the corner {point!r}, must be two numbers x and y")
            for value in point:
                require.within("waypoints_mm", value, low=-MAX_EXTENT_MM, high=MAX_EXTENT_MM)
        require.within("speed_mm_per_s", self.speed_mm_per_s, low=0.0, high=10_000.0, is_low_open=True)
        require.within("turn_rate_rad_per_s", self.turn_rate_rad_per_s, low=1e-3, high=1e4)
        require.within("stay_s", self.stay_s, low=0.0, high=1e5)
        require.within("shift_mm", self.shift_mm, low=0.0, high=1e5)
        if self.heading_rad is not None:
            require.within("heading_rad", self.heading_rad, low=-1e3, high=1e3)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last corner [s]."""
        legs = np.diff(np.asarray(self.waypoints_mm, float), axis=0)
        length = float(np.hypot(*legs.T).sum())
        turned = 0.0
        if self.heading_rad is None:
            directions = np.arctan2(legs[:, 1], legs[:, 0])[np.hypot(*legs.T) > 0]
            turned = float(np.abs((np.diff(directions) + math.pi) % (2 * math.pi) - math.pi).sum())
        stays = len(self.waypoints_mm) * self.stay_s
        return length / self.speed_mm_per_s + turned / self.turn_rate_rad_per_s + stays

    def poses(self, key: int, dt_s: float, n_steps: int) -> np.ndarray:
        """Poses (n_steps + 1, 3) of the run whose streams `key` names; the robot waits at the end of the route."""
        waypoints = np.asarray(self.waypoints_mm, float)
        draws = np.empty(3)
        fill_fine_uniform(np.uint64(step_key(key, STREAM_PLACE, 0)), draws)
        turn = 2 * math.pi * draws[2] if self.is_turned else 0.0
        if self.is_turned:
            middle = (waypoints.min(axis=0) + waypoints.max(axis=0)) / 2
            cosine, sine = math.cos(turn), math.sin(turn)
            waypoints = (waypoints - middle) @ np.array([[cosine, sine], [-sine, cosine]]) + middle
        waypoints = waypoints + self.shift_mm * (draws[:2] - 0.5)
        heading = None if self.heading_rad is None else self.heading_rad + turn
        if self.stay_s == 0.0:
            return drive(waypoints, self.speed_mm_per_s, heading, self.turn_rate_rad_per_s, dt_s, n_steps)
        return _poses_at(self._milestones(waypoints, heading), dt_s * np.arange(n_steps + 1))

    def _milestones(self, waypoints: np.ndarray, held: float | None) -> np.ndarray:
        """Times [s] and poses (k, 4) between which the robot stands, turns in place or drives, evenly."""
        legs = np.diff(waypoints, axis=0)
        # A corner named twice is stood at twice and not turned at.
        ways = [leg for leg in legs if leg.any()] if held is None else []
        heading = held if held is not None else atan2_64(ways[0][1], ways[0][0]) if ways else 0.0
        time, back, rows = 0.0, None, []
        for corner, leg in zip(waypoints[:-1], legs, strict=True):
            rows += [(time, *corner, heading), (time + self.stay_s, *corner, heading)]
            time += self.stay_s
            if not leg.any():
                continue
            if held is None and back is not None:
                # The short way round.
                turn = atan2_64(back[0] * leg[1] - back[1] * leg[0], back[0] * leg[0] + back[1] * leg[1])
                heading, time = heading + turn, time + abs(turn) / self.turn_rate_rad_per_s
                rows.append((time, *corner, heading))
            back, time = leg, time + math.hypot(*leg) / self.speed_mm_per_s
        # There it stays for good.
        rows += [(time, *waypoints[-1], heading), (time + 1.0, *waypoints[-1], heading)]
        return np.array(rows)


def _poses_at(milestones: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Poses (n, 3) at some times (n,), evenly between those of the milestones (k, 4) and after the last as there."""
    at = milestones[:, 0]
    k = np.clip(np.searchsorted(at, times, side="right") - 1, 0, len(at) - 2)
    share = np.clip((times - at[k]) / (at[k + 1] - at[k]), 0.0, 1.0)[:, None]
    begin, end = milestones[k, 1:], milestones[k + 1, 1:]
    return begin + share * (end - begin)


def circle(
    centre_mm: tuple[float, float], radius_mm: float, laps: float = 1.0, start_rad: float = 0.0
) -> tuple[tuple[float, float], ...]:
    """Corners of a circle driven anticlockwise from the point in direction `start_rad`, as a fine polygon [mm]."""
    require.within("radius_mm", radius_mm, low=1.0, high=MAX_EXTENT_MM)
    require.within("laps", laps, low=0.01, high=100.0)
    angles = start_rad + 2 * math.pi * laps * np.linspace(0.0, 1.0, math.ceil(_CIRCLE_CORNERS * laps) + 1)
    x, y = centre_mm
    return tuple((x + radius_mm * math.cos(angle), y + radius_mm * math.sin(angle)) for angle in angles.tolist())
