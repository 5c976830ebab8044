"""Antennas by name: how large they are and what they see of the floor."""

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from itertools import pairwise

from shapely.geometry import Polygon, box

from rfiddesign.geometry import DetectionArea, Disc, Rectangle, sphere_floor_disc


@dataclass(frozen=True)
class Sphere:
    """A detection sphere under an antenna, which the floor cuts: eq. 5 of hf_multireader_mcl.

    Parameters
    ----------
    radius_mm : of the sphere.
    antenna_height_mm : of the antenna above the floor.
    centre_depth_mm : of the sphere's centre below the antenna.
    """

    radius_mm: float
    antenna_height_mm: float
    centre_depth_mm: float

    @property
    def floor_disc(self) -> Disc:
        """What it cuts from the floor; ValueError if it does not reach it."""
        return sphere_floor_disc(self.radius_mm, self.antenna_height_mm, self.centre_depth_mm)


@dataclass(frozen=True)
class Antenna:
    """An antenna one can buy.

    Parameters
    ----------
    name : as studies and price lists call it.
    housing_mm : length (x) and width (y) of the housing.
    area : what it sees of the floor, in its own frame.
    source : where these numbers come from, or "assumption: ...".
    rssi_radii_mm : radius within which the signal reaches each step of RSSI, falling; the first is that of the area,
        which must be a disc.  Empty: reads have no RSSI.
    sphere : what the area was cut from, where that is known.
    """

    name: str
    housing_mm: tuple[float, float]
    area: DetectionArea
    source: str
    rssi_radii_mm: tuple[float, ...] = ()
    sphere: Sphere | None = None

    def __post_init__(self) -> None:
        radii = self.rssi_radii_mm
        if not radii:
            return
        if not isinstance(self.area, Disc) or self.area.radius_mm != radii[0]:
            raise ValueError(f"rssi_radii_mm begins with {radii[0]:g}: must be the radius of the area, a disc")
        if not (all(outer > inner for outer, inner in pairwise(radii)) and radii[-1] > 0):
            raise ValueError(f"rssi_radii_mm is {list(radii)}: must fall from step to step and stay above 0")

    def at_height(self, height_mm: float) -> "Antenna":
        """The same antenna mounted at another height above the floor [mm].

        Raises
        ------
        ValueError : if it has no detection sphere, or one that does not reach the floor from there.
        """
        if self.sphere is None:
            raise ValueError(f"antenna {self.name}: has no detection sphere, what it sees at other heights is unknown")
        sphere = replace(self.sphere, antenna_height_mm=height_mm)
        try:
            return replace(self, area=sphere.floor_disc, sphere=sphere)
        except ValueError:
            radius, depth = sphere.radius_mm, sphere.centre_depth_mm
            reach = f"from {max(depth - radius, 0.0):g} to {depth + radius:g} mm, both left out"
            raise ValueError(f"antenna {self.name}: height is {height_mm:g}, it sees tags {reach}") from None

    def outline(self) -> Polygon:
        """The housing seen from above, centred [mm]."""
        length, width = self.housing_mm
        return box(-length / 2, -width / 2, length / 2, width / 2)


@cache
def antennas() -> dict[str, Antenna]:
    """Every antenna of the catalog by name."""
    text = resources.files("rfiddesign.catalog").joinpath("antennas.toml").read_text(encoding="utf-8")
    return {name: _antenna(name, entry) for name, entry in tomllib.loads(text).items()}


def antenna(name: str) -> Antenna:
    """The antenna of that name; ValueError lists the names there are."""
    known = antennas()
    if name not in known:
        raise ValueError(f"antenna is {name!r}, must be one of {', '.join(known)}")
    return known[name]


def _antenna(name: str, entry: dict) -> Antenna:
    radii = tuple(entry.get("rssi_radii_mm", ()))
    sphere = Sphere(**entry["sphere"]) if "sphere" in entry else None
    if sphere is not None:
        area = sphere.floor_disc
    elif radii:
        area = Disc(radii[0])
    elif "disc_radius_mm" in entry:
        area = Disc(entry["disc_radius_mm"])
    else:
        area = Rectangle(*entry["rectangle_mm"])
    length, width = entry["housing_mm"]
    return Antenna(name, (length, width), area, entry["source"], radii, sphere)
