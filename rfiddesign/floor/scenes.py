"""Scenes: the laboratory and the corridor of uhf_snapshots, and warehouses with rows of shelves.

The paper tells areas, the shelf's size, densities and numbers of tags, and widths of passages; its plan shows no
measures.  What is placed so that these numbers hold:

- Laboratory: 10 x 7 m between the walls, of which desks and their chairs take 17.6 m2 and the shelf 2.4 m2: 50 m2 are
  left.  The passages at the shelf are 1.2 m (at a block of desks), 1.8, 2.9 and 3.2 m wide.
- 90 tags at 1 m height, four per metre, on the walls north (which has the door), east and west; windows in the south.
- 400 tags on the shelf, on five boards.  The paper knew 374 tags in all, fewer than shelf and walls carry; so 116 of
  those on the shelf are taken to stand inside it, behind metal, where nothing reads them.
- Corridor: 30 x 2.5 m behind the laboratory's north wall, with 41 or 109 tags on 20.5 m of each of its long walls (1
  or 2.7 per metre; four per metre, as the text has it, would be 164 tags) and 100 in the laboratory: the 34 on the
  wall between them and 66 on the side of the shelf that faces it.
"""

import numpy as np
import shapely

from rfiddesign import require
from rfiddesign.floor.plan import floor_from_polygon
from rfiddesign.floor.scene import MAX_TAGS, Obstacle, Scene, SceneTags, joined, tags_on_line

#: Radius of the paper's robot, a B21 [mm].
B21_RADIUS_MM = 265.0

_WALL_MM = 150.0
_LENGTH, _WIDTH = 10_000.0, 7_000.0
_SHELF = (4_000.0, 2_900.0, 6_000.0, 4_100.0)
_DESKS = (
    (0.0, 0.0, 800.0, _WIDTH),
    (9_200.0, 0.0, _LENGTH, _WIDTH),
    (3_200.0, 0.0, 6_800.0, 1_100.0),
    (800.0, 2_890.0, 2_800.0, 4_110.0),
)
_DOOR = (7_500.0, 9_000.0)
_BOARDS_MM = (400.0, 700.0, 1_000.0, 1_300.0, 1_600.0)
_TAG_HEIGHT_MM = (1_000.0,)
_N_KNOWN, _N_ON_SHELF = 374, 400
_INSIDE_MM = 300.0
# The corridor is 30 m long and reaches 10 m beyond the laboratory on either side.
_CORRIDOR = (-10_000.0, _WIDTH + _WALL_MM, 20_000.0, _WIDTH + _WALL_MM + 2_500.0)
_TAGGED = (-5_250.0, 15_250.0)
_N_CORRIDOR = {"lower": 41, "higher": 109}
_N_SEEN_ON_SHELF = 66


def laboratory() -> Scene:
    """The paper's laboratory: 50 m2, 490 tags of which 374 can be read."""
    room = shapely.box(0.0, 0.0, _LENGTH, _WIDTH)
    keep_outs = [shapely.box(*_SHELF), *(shapely.box(*desk) for desk in _DESKS)]
    floor = floor_from_polygon(room, keep_outs, B21_RADIUS_MM, name="laboratory", source="after uhf_snapshots")
    east = tags_on_line((_LENGTH, 0.0), (_LENGTH, _WIDTH), 28, _TAG_HEIGHT_MM)
    west = tags_on_line((0.0, _WIDTH), (0.0, 0.0), 28, _TAG_HEIGHT_MM)
    return Scene(floor, _laboratory_obstacles(), joined([_north_tags(), east, west, *_shelf_tags()]))


def corridor(density: str = "higher") -> Scene:
    """The paper's corridor: 75 m2, 141 tags at the lower density and 209 at the higher, 100 of them in the laboratory.

    Raises
    ------
    ValueError : if the density is neither "lower" nor "higher".
    """
    if density not in _N_CORRIDOR:
        raise ValueError(f"density is {density!r}, must be one of {', '.join(_N_CORRIDOR)}")
    low_x, low_y, high_x, high_y = _CORRIDOR
    floor = floor_from_polygon(
        shapely.box(*_CORRIDOR), (), B21_RADIUS_MM, name=f"corridor, {density} density", source="after uhf_snapshots"
    )
    begin, end = _TAGGED
    n = _N_CORRIDOR[density]
    south = tags_on_line((begin, low_y), (end, low_y), n // 2, _TAG_HEIGHT_MM)
    # The door of the laboratory has no tags: they move to its two sides.
    south = _beside_door(south)
    north = tags_on_line((end, high_y), (begin, high_y), n - n // 2, _TAG_HEIGHT_MM)
    facing_north = _shelf_tags()[0]
    seen = facing_north.chosen(np.flatnonzero(facing_north.positions[:, 1] > _SHELF[3]))
    seen = seen.chosen(np.linspace(0, len(seen) - 1, _N_SEEN_ON_SHELF).round().astype(int))
    walls = [
        shapely.box(low_x, high_y, high_x, high_y + _WALL_MM),
        shapely.box(low_x - _WALL_MM, low_y, low_x, high_y),
        shapely.box(high_x, low_y, high_x + _WALL_MM, high_y),
        shapely.box(low_x, _WIDTH, -_WALL_MM, low_y),
        shapely.box(_LENGTH + _WALL_MM, _WIDTH, high_x, low_y),
    ]
    obstacles = _laboratory_obstacles() + tuple(Obstacle(wall, "wall") for wall in walls)
    return Scene(floor, obstacles, joined([south, north, _north_tags(), seen]))


def _north_tags() -> SceneTags:
    """34 tags, four per metre, on the laboratory's side of its north wall, beside the door."""
    door_begin, door_end = _DOOR
    return joined(
        [
            tags_on_line((_LENGTH, _WIDTH), (door_end, _WIDTH), 4, _TAG_HEIGHT_MM),
            tags_on_line((door_begin, _WIDTH), (0.0, _WIDTH), 30, _TAG_HEIGHT_MM),
        ]
    )


def _beside_door(tags: SceneTags) -> SceneTags:
    door_begin, door_end = _DOOR
    positions = tags.positions.copy()
    x = positions[:, 0]
    is_in_door = (x > door_begin) & (x < door_end)
    is_left = is_in_door & (x < (door_begin + door_end) / 2)
    positions[is_left, 0] = door_begin - (x[is_left] - door_begin)
    is_right = is_in_door & ~is_left
    positions[is_right, 0] = door_end + (door_end - x[is_right])
    return SceneTags(positions, tags.facing, tags.heights)


def _shelf_tags() -> tuple[SceneTags, SceneTags]:
    """The tags at the shelf's fronts, and those that stand inside it, behind metal."""
    low_x, low_y, high_x, high_y = _SHELF
    sides = (
        ((high_x, high_y), (low_x, high_y), 25),
        ((low_x, high_y), (low_x, low_y), 15),
        ((low_x, low_y), (high_x, low_y), 25),
        ((high_x, low_y), (high_x, high_y), 15),
    )
    # The way about the shelf has it on the left, and tags face left: so each side is walked backwards.
    front = joined([tags_on_line(end, begin, n, _BOARDS_MM) for begin, end, n in sides])
    inside = joined([tags_on_line(end, begin, n, _BOARDS_MM, -_INSIDE_MM) for begin, end, n in sides])
    n_inside = 90 + _N_ON_SHELF - _N_KNOWN
    rank = np.arange(_N_ON_SHELF + 1) * n_inside // _N_ON_SHELF
    is_inside = np.diff(rank) > 0
    return front.chosen(~is_inside), inside.chosen(is_inside)


def _laboratory_obstacles() -> tuple[Obstacle, ...]:
    door_begin, door_end = _DOOR
    far_x, far_y = _LENGTH + _WALL_MM, _WIDTH + _WALL_MM
    walls = (
        shapely.box(-_WALL_MM, -_WALL_MM, far_x, 0.0),
        shapely.box(-_WALL_MM, 0.0, 0.0, far_y),
        shapely.box(_LENGTH, 0.0, far_x, far_y),
        shapely.box(0.0, _WIDTH, door_begin, far_y),
        shapely.box(door_end, _WIDTH, _LENGTH, far_y),
    )
    return (*(Obstacle(wall, "wall") for wall in walls), Obstacle(shapely.box(*_SHELF), "shelf"))


def warehouse(
    length_mm: float, width_mm: float, *, aisle_mm: float = 2_000.0, shelf_depth_mm: float = 1_200.0,
    tags_per_m: float = 4.0, footprint_mm: float = 300.0, heights: tuple[float, ...] = _TAG_HEIGHT_MM,
) -> Scene:  # fmt: skip
    """A rectangle with rows of metal shelves along x, tagged on their two long fronts.

    As many rows as fit with aisles of at least `aisle_mm` beside each; what is left of the width widens all aisles
    alike. A cross aisle of the least width runs at either end. The lower left corner is the origin.

    Parameters
    ----------
    length_mm, width_mm : inside of the walls [mm].
    aisle_mm : least width of an aisle [mm].
    shelf_depth_mm : depth of a row, of two shelves back to back [mm].
    tags_per_m : tags per metre of a row's front, all heights together.
    footprint_mm : radius of the robots [mm].
    heights : heights at which the tags of a front sit in turn [mm].

    Raises
    ------
    ValueError : if a size is not positive, no row fits, there would be too many tags, or the robot does not fit.
    """
    sizes = {
        "length_mm": length_mm, "width_mm": width_mm, "aisle_mm": aisle_mm, "shelf_depth_mm": shelf_depth_mm,
        "tags_per_m": tags_per_m,
    }  # fmt: skip
    for name, size in sizes.items():
        require.positive(name, size)
    n_rows = int((width_mm - aisle_mm) // (shelf_depth_mm + aisle_mm))
    row_mm = length_mm - 2 * aisle_mm
    if n_rows < 1 or row_mm <= 0:
        raise ValueError(f"aisle_mm is {aisle_mm:g}: no row of shelves fits into {length_mm:g} x {width_mm:g} mm")
    n_per_front = max(1, round(tags_per_m * row_mm / 1_000.0))
    if 2 * n_rows * n_per_front > MAX_TAGS:
        raise ValueError(f"tags_per_m is {tags_per_m:g}: {2 * n_rows * n_per_front:,} tags, allowed are {MAX_TAGS:,}")
    gap = (width_mm - n_rows * shelf_depth_mm) / (n_rows + 1)
    lows = [gap + row * (shelf_depth_mm + gap) for row in range(n_rows)]
    shelves = [shapely.box(aisle_mm, low, length_mm - aisle_mm, low + shelf_depth_mm) for low in lows]
    floor = floor_from_polygon(
        shapely.box(0.0, 0.0, length_mm, width_mm), shelves, footprint_mm, name="warehouse",
        source=f"{length_mm:g} x {width_mm:g} mm, {n_rows} rows of shelves",
    )  # fmt: skip
    begin, end = aisle_mm, length_mm - aisle_mm
    fronts = []
    for low in lows:
        fronts.append(tags_on_line((end, low), (begin, low), n_per_front, (0.0,)))
        fronts.append(tags_on_line((begin, low + shelf_depth_mm), (end, low + shelf_depth_mm), n_per_front, (0.0,)))
    tags = joined(fronts)
    in_turn = np.resize(np.array(heights, float), len(tags))
    return Scene(
        floor, tuple(Obstacle(shelf, "shelf") for shelf in shelves), SceneTags(tags.positions, tags.facing, in_turn)
    )
