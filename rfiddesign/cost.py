"""What a design costs over a fleet and a floor, line by line, in exact cents."""

import math
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal

from rfiddesign.design import Design
from rfiddesign.units import CENTS_PER_UNIT


@dataclass(frozen=True)
class Price:
    """A unit price in the list's currency, and where it comes from (or the word "assumption")."""

    amount: Decimal
    source: str


@dataclass(frozen=True)
class PriceList:
    """Prices of everything a design is made of.

    Parameters
    ----------
    currency : code of the currency, as "EUR".
    reader : one reader, per robot and antenna.
    antennas : (name, price) of one antenna.
    controllers : (channels, price) of the controllers or multiplexers one can buy; a robot gets the cheapest set with
        a channel for every reader.
    cabling : cable and mounting of one antenna.
    tag, tag_laying : one tag, and the labour of laying it.
    covering_per_m2, survey_per_m2 : covering of the floor and survey of where its tags lie [per m2].
    project : fixed price of a project.
    """

    currency: str
    reader: Price
    antennas: tuple[tuple[str, Price], ...]
    controllers: tuple[tuple[int, Price], ...]
    cabling: Price
    tag: Price
    tag_laying: Price
    covering_per_m2: Price
    survey_per_m2: Price
    project: Price


@dataclass(frozen=True)
class ShelfPrices:
    """Prices of everything that localizing by tagged shelves takes.

    Parameters
    ----------
    currency : code of the currency, as "EUR".
    reader : one UHF reader, per robot.
    antenna, cabling : one antenna, and its cable and mounting.
    tag, attaching : one tag, and the labour of attaching it to a shelf.
    training_minute : a minute of a training drive: robot and who minds it.
    localizer_day : hire of the reference localizer that training needs, per begun day of driving.
    localizer_setup : mapping the hall for it.
    project : fixed price of a project.
    """

    currency: str
    reader: Price
    antenna: Price
    cabling: Price
    tag: Price
    attaching: Price
    training_minute: Price
    localizer_day: Price
    localizer_setup: Price
    project: Price


#: Minutes of training drives in a day, batteries and breaks off [min].
TRAINING_DAY_MIN = 360


@dataclass(frozen=True)
class ShelfEquipment:
    """What of a shelf design has a price: antennas per robot, tags on the shelves, minutes of training [min]."""

    n_antennas: int
    n_tags: int
    training_min: float


@dataclass(frozen=True)
class Site:
    """What a cost is counted over: robots of the fleet and tagged floor."""

    n_robots: int
    area_m2: float


@dataclass(frozen=True)
class Equipment:
    """What of a design has a price: readers per robot, name of their antennas, tags in the floor."""

    n_readers: int
    antenna: str
    n_tags: int


@dataclass(frozen=True)
class CostLine:
    """One line of a cost table: quantity times unit price, rounded half up to cents."""

    group: str
    item: str
    quantity: Decimal
    unit: str
    unit_price: Decimal
    amount_cents: int
    source: str


@dataclass(frozen=True)
class Cost:
    """Cost of a design with its lines."""

    currency: str
    lines: tuple[CostLine, ...]

    @property
    def total_cents(self) -> int:
        """Sum of the lines [cents]."""
        return sum(line.amount_cents for line in self.lines)


def cost(design: Design, n_tags: int, site: Site, prices: PriceList) -> Cost:
    """Cost of equipping every robot of a site and laying `n_tags` tags into its floor.

    Raises
    ------
    ValueError : if the list has no price for the antenna.
    """
    return cost_of(Equipment(design.layout.n_readers, design.antenna.name, n_tags), site, prices)


def cost_of(equipment: Equipment, site: Site, prices: PriceList) -> Cost:
    """Cost of what a design is made of, as `cost`."""
    antennas, name = dict(prices.antennas), equipment.antenna
    if name not in antennas:
        raise ValueError(f"no price for antenna {name!r}, the list has {', '.join(antennas)}")
    robots = Decimal(site.n_robots)
    n_antennas = robots * equipment.n_readers
    area = Decimal(str(round(site.area_m2, 2)))
    lines = [
        line_of("per robot", "reader", n_antennas, "piece", prices.reader),
        line_of("per robot", f"antenna {name} mm", n_antennas, "piece", antennas[name]),
    ]
    for (channels, price), n in controller_set(equipment.n_readers, prices.controllers):
        lines.append(line_of("per robot", f"controller, {channels} channels", robots * n, "piece", price))
    lines += [
        line_of("per robot", "cabling and mounting of an antenna", n_antennas, "piece", prices.cabling),
        line_of("per tag", "tag", Decimal(equipment.n_tags), "piece", prices.tag),
        line_of("per tag", "laying a tag", Decimal(equipment.n_tags), "piece", prices.tag_laying),
        line_of("per m2", "covering", area, "m2", prices.covering_per_m2),
        line_of("per m2", "survey", area, "m2", prices.survey_per_m2),
        line_of("per project", "project", Decimal(1), "piece", prices.project),
    ]
    return Cost(prices.currency, tuple(lines))


def shelf_cost(equipment: ShelfEquipment, n_robots: int, prices: ShelfPrices) -> Cost:
    """Cost of localizing a fleet by tagged shelves; one robot trains for all."""
    robots = Decimal(n_robots)
    n_antennas, n_tags = robots * equipment.n_antennas, Decimal(equipment.n_tags)
    minutes = Decimal(str(round(equipment.training_min, 2)))
    days = Decimal(math.ceil(equipment.training_min / TRAINING_DAY_MIN))
    lines = (
        line_of("per robot", "UHF reader", robots, "piece", prices.reader),
        line_of("per robot", "UHF antenna", n_antennas, "piece", prices.antenna),
        line_of("per robot", "cabling and mounting of an antenna", n_antennas, "piece", prices.cabling),
        line_of("per tag", "UHF tag", n_tags, "piece", prices.tag),
        line_of("per tag", "attaching a tag", n_tags, "piece", prices.attaching),
        line_of("training", "training drive", minutes, "minute", prices.training_minute),
        line_of("training", "hire of the reference localizer", days, "day", prices.localizer_day),
        line_of("training", "map for the reference localizer", Decimal(1), "piece", prices.localizer_setup),
        line_of("per project", "project", Decimal(1), "piece", prices.project),
    )
    return Cost(prices.currency, lines)


def controller_set(n_channels: int, controllers: tuple[tuple[int, Price], ...]) -> list[tuple[tuple[int, Price], int]]:
    """The cheapest set of controllers with at least `n_channels` channels: (controller, how many of it), largest first.

    Of equally cheap sets the one with fewest pieces.
    """
    # best[k]: (price, pieces, index of the last piece) of the cheapest set with at least k channels.
    best: list[tuple[Decimal, int, int]] = [(Decimal(0), 0, -1)]
    for k in range(1, n_channels + 1):
        best.append(
            min(
                (best[max(k - channels, 0)][0] + price.amount, best[max(k - channels, 0)][1] + 1, i)
                for i, (channels, price) in enumerate(controllers)
            )
        )
    counts: dict[int, int] = {}
    k = n_channels
    while k > 0:
        i = best[k][2]
        counts[i] = counts.get(i, 0) + 1
        k = max(k - controllers[i][0], 0)
    return [(controllers[i], counts[i]) for i in sorted(counts, key=lambda i: -controllers[i][0])]


def line_of(group: str, item: str, quantity: Decimal, unit: str, price: Price) -> CostLine:
    """A line of a cost table: `quantity` pieces (or `unit`s) at a price, rounded half up to cents."""
    amount = (quantity * price.amount * CENTS_PER_UNIT).quantize(Decimal(1), ROUND_HALF_UP)
    return CostLine(group, item, quantity, unit, price.amount, int(amount), price.source)
