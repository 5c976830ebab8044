"""What a report says of routes: their length, the cheapest design of each kind, and the tags placed along them."""

from dataclasses import dataclass

from rfiddesign.report.album import Picture
from rfiddesign.report.contents import Contents
from rfiddesign.report.extra import Extra
from rfiddesign.report.figures import routes_figure
from rfiddesign.report.figures.place import place_on_route
from rfiddesign.report.tables import Table
from rfiddesign.report.words import count, percent
from rfiddesign.results.routes import CheapestRecord, NetworkRecord, PlacementRecord, RoutesRecord
from rfiddesign.units import money

ON_FLOOR, ON_ROUTES = "whole floor", "routes alone"


@dataclass(frozen=True)
class RoutesPart:
    """The section on routes."""

    network: str
    cheapest: Table
    savings: tuple[str, ...]
    placements: tuple[tuple[str, Table, tuple[str, ...]], ...]


def routes_extra(contents: Contents) -> Extra | None:
    """The section on routes; None where robots drive anywhere."""
    if contents.routes is None:
        return None
    return Extra("routes", "Routes", "routes.html.jinja", _part(contents, contents.routes), _pictures(contents))


def _part(contents: Contents, routes: RoutesRecord) -> RoutesPart:
    currency = contents.answers[0].record.currency
    return RoutesPart(
        network=_network_words(routes.network),
        cheapest=_cheapest_table(routes, currency),
        savings=_savings(routes, currency),
        placements=tuple(
            (_heading(placement), _placement_table(placement), _placement_words(placement, currency))
            for placement in routes.placements
        ),
    )


def _pictures(contents: Contents) -> tuple[Picture, ...]:
    """The plan with routes, stations and the tags of each answer."""
    network, plan, found = contents.routes.network, contents.plan, []
    for answer in contents.answers:
        if answer.chosen is not None:
            place = place_on_route(network)
            figure = routes_figure(plan.drivable, network, answer.tags_mm, answer.chosen, place)
            fleet = count(answer.record.n_robots, "robot")
            caption = f"{fleet}: routes, stations and the tags of {answer.chosen.name}."
            found.append(Picture("routes", f"routes-{answer.key}", caption, figure))
    return tuple(found)


def _network_words(network: NetworkRecord) -> str:
    return (
        f"Robots drive between {count(network.n_stations, 'station')} along {network.length_m:,.0f} m of routes, up to"
        f" {network.lateral_mm:g} mm beside them and turned off them by up to {network.yaw_deg:g}°. They sweep"
        f" {network.swath_m2:,.0f} m² of the floor, {2 * network.half_width_mm:,.0f} mm wide: where tags lie on routes"
        " alone, that is what is covered and surveyed. All drives keep to the routes, over tags on the whole floor too."
    )


def _cheapest_table(routes: RoutesRecord, currency: str) -> Table:
    rows = []
    for record in routes.cheapest:
        where = ON_FLOOR if record.is_whole_floor else ON_ROUTES
        how = "the answer" if record.is_answer else "a search among these alone"
        if record.winner is None:
            rows.append((count(record.n_robots, "robot"), where, "none certified", "", "", "", "", how))
            continue
        rows.append(
            (
                count(record.n_robots, "robot"), where, record.name,
                money(record.winner.cost_cents, currency), f"{record.n_tags:,}", f"{record.tagged_m2:,.0f}",
                f"{record.winner.n_passed:,} of {record.winner.n_runs:,}", how,
            )
        )  # fmt: skip
    headers = (
        "Fleet",
        "Tags on",
        "Cheapest certified design",
        "Price",
        "Tags",
        "Tagged m²",
        "Drives passed",
        "Found by",
    )
    return Table(headers, tuple(rows), numeric=(3, 4, 5, 6))


def _savings(routes: RoutesRecord, currency: str) -> tuple[str, ...]:
    words = []
    for n_robots in dict.fromkeys(record.n_robots for record in routes.cheapest):
        kinds = {record.is_whole_floor: record for record in routes.cheapest if record.n_robots == n_robots}
        if len(kinds) == 2 and all(record.winner is not None for record in kinds.values()):
            words.append(_saving(kinds[True], kinds[False], currency))
    return tuple(words)


def _saving(floor: CheapestRecord, routes: CheapestRecord, currency: str) -> str:
    saved = floor.winner.cost_cents - routes.winner.cost_cents
    more = "less" if saved >= 0 else "more"
    return (
        f"{count(floor.n_robots, 'robot')}: with tags on routes alone the installation costs"
        f" {money(abs(saved), currency)} {more} than with tags on the whole floor"
        f" ({percent(abs(saved) / floor.winner.cost_cents)}). Each of the two is certified by a search of its own;"
        " robots that leave the routes find tags only on the latter."
    )


def _heading(placement: PlacementRecord) -> str:
    fleet = count(placement.n_robots, "robot")
    return f"{fleet}: tags placed for {placement.layout} with {placement.antenna} mm antennas"


def _placement_table(placement: PlacementRecord) -> Table:
    drive = placement.drive
    proved = " (proved the fewest)" if placement.method == "proved" else ""
    rows = [
        ("tags", f"{placement.n_tags:,}{proved}"),
        ("fewest that any choice of the candidate places needs", f"{placement.lower_bound:,}"),
        ("gap: tags that the bound leaves open", percent(placement.gap)),
        ("windows of travel, with deviations", f"{placement.n_windows:,}"),
        ("of these, windows that no tags can serve", f"{placement.n_unserved:,}"),
        ("fewest tags in any window that can be served", f"{placement.min_cover:,}"),
        ("longest way without a read in the check, as planned", f"{drive.planned_mm:,.0f} mm"),
        ("the same with the worst tag dead", f"{drive.planned_spare_mm:,.0f} mm"),
        ("longest way without a read at random deviations", f"{drive.random_mm:,.0f} mm"),
        ("the same with the worst tag dead", f"{drive.random_spare_mm:,.0f} mm"),
    ]
    return Table(("Placement", "Value"), tuple(rows), numeric=(1,))


def _placement_words(placement: PlacementRecord, currency: str) -> tuple[str, ...]:
    spare = count(placement.n_spare, "tag") + " dead" if placement.n_spare else "all tags alive"
    drive = placement.drive
    words = [
        f"Promised by geometry: wherever on the routes a robot is, it reads a tag within {placement.distance_mm:g} mm"
        f" of way, with any {spare}; the windows that no tags can serve are excepted.",
        f"The check drove {drive.driven_m:,.0f} m in {count(drive.n_drives, 'drive')} over the tags as laid and knows"
        " no windows; a way without a read is known to one step of 4 mm.",
    ]
    if placement.n_tags_in_lines is not None:
        more = placement.n_tags_in_lines - placement.n_tags
        words.append(
            f"In lines that an installer can lay, the same promise takes {placement.n_tags_in_lines:,} tags:"
            f" {abs(more):,} {'more' if more >= 0 else 'fewer'}, {money(abs(placement.in_lines_cents), currency)}."
        )
    elif not placement.is_in_lines:
        words.append("No tags in lines were found that keep the same promise.")
    return tuple(words)
