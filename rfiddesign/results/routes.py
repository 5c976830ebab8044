"""Routes of a study and the tags placed along them (`routes.json`)."""

from rfiddesign.results.study_result import DecisionRecord, Record


class EdgeRecord(Record):
    """A piece of a route between two nodes."""

    nodes: tuple[int, int]
    points_mm: list[tuple[float, float]]


class NetworkRecord(Record):
    """The routes that robots drive.

    Parameters
    ----------
    nodes_mm : stations, which come first, and junctions.
    swath_m2 : floor that robots sweep along the routes, which is tagged where tags lie on routes alone.
    """

    n_stations: int
    nodes_mm: list[tuple[float, float]]
    edges: list[EdgeRecord]
    length_m: float
    swath_m2: float
    half_width_mm: float
    lateral_mm: float
    yaw_deg: float


class DriveCheckRecord(Record):
    """Longest distances without a read that an independent drive along the routes measured [mm].

    `planned` at the deviations that the placement was made for, `random` at others within their bounds; `spare` with
    the one tag dead whose loss is worst. `random_share_over` is the share of the random drives' length driven farther
    than the promised distance after a read.
    """

    planned_mm: float
    planned_spare_mm: float
    random_mm: float
    random_spare_mm: float
    random_share_over: float
    n_drives: int
    driven_m: float


class PlacementRecord(Record):
    """Tags placed along the routes for the layout and antenna of a fleet's design.

    Parameters
    ----------
    lower_bound : no choice of the candidate places that keeps the promise has fewer tags.
    gap : share of the tags that the bound leaves open.
    n_windows, n_unserved : windows of travel times deviations, and those that no choice of places can serve.
    unserved : places (x, y [mm], heading [rad]) of some of these.
    n_tags_in_lines, in_lines_cents : tags for the same promise in lines that an installer can lay, and what they cost
        more; None where the tags lie in lines already or cannot.
    """

    n_robots: int
    design: int
    layout: str
    antenna: str
    distance_mm: float
    n_spare: int
    is_in_lines: bool
    n_tags: int
    lower_bound: int
    gap: float
    method: str
    n_windows: int
    n_unserved: int
    unserved: list[tuple[float, float, float]]
    min_cover: int
    drive: DriveCheckRecord
    n_tags_in_lines: int | None
    in_lines_cents: int | None


class CheapestRecord(Record):
    """The cheapest certified design of one kind: on the whole floor, or on routes alone.

    Parameters
    ----------
    is_whole_floor : which kind.
    n_candidates : how many of that kind are in the space.
    is_answer : whether it is the study's answer; otherwise a search among its kind alone found it, whose chance of
        error is its own.
    claim_words : what that search claims.
    """

    n_robots: int
    is_whole_floor: bool
    n_candidates: int
    is_answer: bool
    claim_words: str
    winner: DecisionRecord | None
    name: str
    n_tags: int
    tagged_m2: float
    n_runs_used: int


class RoutesRecord(Record):
    """Everything that a report says of routes."""

    network: NetworkRecord
    placements: list[PlacementRecord]
    cheapest: list[CheapestRecord]
