"""What a study found out about routes, as the record that is saved: `routes.json`."""

from dataclasses import dataclass, replace
from pathlib import Path

from rfiddesign.cost import Site
from rfiddesign.floor import Floor, RouteNetwork
from rfiddesign.geometry import OnRoutesPattern, PlacedPattern
from rfiddesign.optimize import CLAIMS
from rfiddesign.optimize.tag_placement import TagPlacement, choose_tags, place_tags
from rfiddesign.results import folder as files
from rfiddesign.results import routes as records
from rfiddesign.study.candidates import Candidates
from rfiddesign.study.design_document import rounded
from rfiddesign.study.document import decision_record
from rfiddesign.study.load import Study
from rfiddesign.study.outcomes import StoredRuns
from rfiddesign.study.pipeline import Answer, Fleet, price_design, search_fleet
from rfiddesign.study.route_placement import placement_rules
from rfiddesign.study.routes import network_of
from rfiddesign.study.stages import OnStage, Stage

# Places listed of windows that no tags can serve.
MAX_UNSERVED = 200


@dataclass(frozen=True)
class RoutesFound:
    """What is known when a study's searches have ended.

    Parameters
    ----------
    answers : the study's own.
    others : for each answer, that of a search among designs of the other kind (whole floor against routes), or None.
    """

    study: Study
    floor: Floor
    candidates: Candidates
    answers: tuple[Answer, ...]
    others: tuple[Answer | None, ...]


def search_other_kinds(
    study: Study, candidates: Candidates, answers: tuple[Answer, ...], runs: StoredRuns, on_stage: OnStage
) -> tuple[Answer | None, ...]:
    """For each answer the cheapest certified design of the other kind: on the whole floor if it lies on routes.

    A search of its own among these designs alone, with chances of error of its own; none where there are no such
    designs, the answer found nothing, or runs and minutes are limited.
    """
    plain = study.file.search.model_copy(update={"next_best": 0})
    alone = replace(study, file=study.file.model_copy(update={"search": plain}))
    found: list[Answer | None] = []
    for answer in answers:
        others = None if answer.search.winner is None else _of_kind(candidates, not _is_whole(candidates, answer))
        if others is None or not others.by_number or study.file.search.is_short:
            found.append(None)
            continue
        costs = {number: answer.costs[number] for number in others.numbers}
        found.append(search_fleet(alone, others, Fleet(answer.n_robots, costs), runs, on_stage))
    return tuple(found)


def save_routes(out: Path, found: RoutesFound, on_stage: OnStage) -> None:
    """Write `routes.json`, if the study's robots drive along routes."""
    if found.study.file.drives_on_routes:
        files.write_record(out / files.ROUTES, routes_record(found, on_stage))


def routes_record(found: RoutesFound, on_stage: OnStage) -> records.RoutesRecord:
    """The routes, what was placed along them for the answers, and the cheapest design of each kind."""
    study = found.study
    network = network_of(study.file, study.path, found.floor)
    placements: list[records.PlacementRecord] = []
    for answer, other in zip(found.answers, found.others, strict=True):
        for each, candidates in ((answer, found.candidates), (other, _others(found.candidates, answer, other))):
            if each is not None and each.search.winner is not None:
                number = candidates.numbers[each.search.winner]
                if isinstance(candidates.by_number[number].design.pattern, PlacedPattern):
                    on_stage(Stage(f"bounding the tags along routes, {each.n_robots:,} robots"))
                    placements.append(_placement(found, each, number))
    cheapest = []
    for answer, other in zip(found.answers, found.others, strict=True):
        if answer.search.winner is not None:
            cheapest.append(_cheapest(answer, found.candidates, is_answer=True))
        if other is not None:
            cheapest.append(_cheapest(other, _others(found.candidates, answer, other), is_answer=False))
    return records.RoutesRecord(network=_network(study, network), placements=placements, cheapest=cheapest)


def _is_on_routes(candidates: Candidates, number: int) -> bool:
    return isinstance(candidates.by_number[number].design.pattern, OnRoutesPattern | PlacedPattern)


def _is_whole(candidates: Candidates, answer: Answer) -> bool:
    return not _is_on_routes(candidates, candidates.numbers[answer.search.winner])


def _of_kind(candidates: Candidates, is_whole: bool) -> Candidates:
    """The candidates that tag the whole floor, or those on routes."""
    mine = {n: each for n, each in candidates.by_number.items() if _is_on_routes(candidates, n) != is_whole}
    promise = {number: value for number, value in candidates.promise.items() if number in mine}
    return replace(candidates, by_number=mine, promise=promise)


def _others(candidates: Candidates, answer: Answer, other: Answer | None) -> Candidates:
    """The candidates that the indices of `other` point into."""
    return candidates if other is None else _of_kind(candidates, not _is_whole(candidates, answer))


def _network(study: Study, network: RouteNetwork) -> records.NetworkRecord:
    section = study.file.routes
    return records.NetworkRecord(
        n_stations=network.n_stations,
        nodes_mm=[_point(node) for node in network.nodes_mm],
        edges=[
            records.EdgeRecord(nodes=tuple(nodes), points_mm=[_point(point) for point in edge])
            for nodes, edge in zip(network.ends.tolist(), network.edges_mm, strict=True)
        ],
        length_m=rounded(network.length_mm / 1e3),
        swath_m2=rounded(network.swath.area / 1e6),
        half_width_mm=study.file.robot.footprint_radius_mm,
        lateral_mm=section.lateral_mm,
        yaw_deg=section.yaw_deg,
    )


def _placement(found: RoutesFound, answer: Answer, number: int) -> records.PlacementRecord:
    """The placement of an answer's tags once more, with its bound and its check."""
    study, candidate = found.study, found.candidates.by_number[number]
    design, pattern = candidate.design, candidate.design.pattern
    rules = placement_rules(study.file, design, pattern.distance_mm)
    robot = (pattern.strip.routes_mm, design.layout, design.antenna.area)
    placement = place_tags(*robot, rules, pattern.strip.swath, study.file.seed)
    n_in_lines = None
    if not rules.is_in_lines:
        try:
            in_lines = replace(rules, is_in_lines=True)
            n_in_lines = len(choose_tags(*robot, in_lines, pattern.strip.swath, study.file.seed))
        except ValueError:
            n_in_lines = None
    return records.PlacementRecord(
        n_robots=answer.n_robots,
        design=number,
        layout=design.layout.name,
        antenna=design.antenna.name,
        distance_mm=pattern.distance_mm,
        n_spare=rules.n_spare,
        is_in_lines=rules.is_in_lines,
        n_tags=placement.n_tags,
        lower_bound=placement.lower_bound,
        gap=rounded(placement.gap),
        method=placement.method,
        n_windows=placement.n_windows,
        n_unserved=placement.n_unserved,
        unserved=[tuple(map(rounded, place)) for place in placement.unserved[:MAX_UNSERVED].tolist()],
        min_cover=placement.min_cover,
        drive=_drive(placement),
        n_tags_in_lines=n_in_lines,
        in_lines_cents=None if n_in_lines is None else _more_cents(found, answer, number, n_in_lines),
    )


def _more_cents(found: RoutesFound, answer: Answer, number: int, n_tags: int) -> int:
    """What an answer's design would cost more with so many tags."""
    candidate = found.candidates.by_number[number]
    site = Site(answer.n_robots, candidate.tagged_m2)
    return price_design(found.study, candidate.design, n_tags, site).total_cents - answer.costs[number].total_cents


def _drive(placement: TagPlacement) -> records.DriveCheckRecord:
    drive = placement.drive
    return records.DriveCheckRecord(
        planned_mm=rounded(drive.planned_mm),
        planned_spare_mm=rounded(drive.planned_spare_mm),
        random_mm=rounded(drive.random_mm),
        random_spare_mm=rounded(drive.random_spare_mm),
        random_share_over=rounded(drive.random_share_over),
        n_drives=drive.n_drives,
        driven_m=rounded(drive.driven_m),
    )


def _cheapest(answer: Answer, candidates: Candidates, *, is_answer: bool) -> records.CheapestRecord:
    search = answer.search
    is_whole = not _is_on_routes(candidates, candidates.numbers[search.winner if search.winner is not None else 0])
    winner, name, n_tags, tagged_m2 = None, "", 0, 0.0
    if search.winner is not None:
        number = candidates.numbers[search.winner]
        found = candidates.by_number[number]
        name, n_tags, tagged_m2 = found.name, found.n_tags, found.tagged_m2
        winner = decision_record(answer, number, search.decisions[search.winner])
    return records.CheapestRecord(
        n_robots=answer.n_robots,
        is_whole_floor=is_whole,
        n_candidates=len(_of_kind(candidates, is_whole).by_number),
        is_answer=is_answer,
        claim_words=CLAIMS[search.claim],
        winner=winner,
        name=name,
        n_tags=n_tags,
        tagged_m2=rounded(tagged_m2),
        n_runs_used=search.n_runs_used,
    )


def _point(point: object) -> tuple[float, float]:
    x, y = point
    return rounded(float(x)), rounded(float(y))
