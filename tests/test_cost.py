"""What a design costs: every cent of it, and the cheapest controllers for its readers."""

from dataclasses import replace
from decimal import Decimal
from itertools import product

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rfiddesign.catalog import antenna
from rfiddesign.cost import Price, PriceList, ShelfEquipment, ShelfPrices, Site, controller_set, cost, shelf_cost
from rfiddesign.design import Design
from rfiddesign.geometry import make_layout, make_pattern


def price(amount: str, source: str = "assumption") -> Price:
    return Price(Decimal(amount), source)


PRICES = PriceList(
    currency="EUR",
    reader=price("42.00", "offer 17"),
    antennas=(("60x60", price("7.50")), ("80x80", price("10"))),
    controllers=((4, price("55.00")), (8, price("95.00"))),
    cabling=price("7.50"),
    tag=price("0.30"),
    tag_laying=price("0.45"),
    covering_per_m2=price("14.00"),
    survey_per_m2=price("1.205"),
    project=price("100.00"),
)
CROSS = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=100))


def test_every_line_is_quantity_times_price_as_by_hand():
    found = cost(CROSS, 1234, Site(5, 10.5), PRICES)
    assert [(line.group, line.item, line.quantity, line.amount_cents) for line in found.lines] == [
        ("per robot", "reader", 40, 168_000),
        ("per robot", "antenna 60x60 mm", 40, 30_000),
        ("per robot", "controller, 8 channels", 5, 47_500),
        ("per robot", "cabling and mounting of an antenna", 40, 30_000),
        ("per tag", "tag", 1234, 37_020),
        ("per tag", "laying a tag", 1234, 55_530),
        ("per m2", "covering", Decimal("10.5"), 14_700),
        ("per m2", "survey", Decimal("10.5"), 1_265),  # 12.6525
        ("per project", "project", 1, 10_000),
    ]
    assert found.total_cents == 394_015
    assert found.currency == "EUR"
    assert found.lines[0].source == "offer 17"


def test_two_hundred_robots_cost_forty_times_five_robots_and_the_floor_the_same():
    few, many = (cost(CROSS, 1234, Site(n, 10.5), PRICES) for n in (5, 200))
    for one, other in zip(few.lines, many.lines, strict=True):
        factor = 40 if one.group == "per robot" else 1
        assert other.amount_cents == factor * one.amount_cents
    assert many.total_cents == 40 * 275_500 + 118_515


@pytest.mark.parametrize(("amount", "cents"), [("0.005", 1), ("0.025", 3), ("0.0249", 2), ("0.004999", 0), ("1", 100)])
def test_half_a_cent_is_rounded_up(amount, cents):
    assert cost(CROSS, 1, Site(1, 1.0), replace(PRICES, project=price(amount))).lines[-1].amount_cents == cents


def test_prices_are_decimal_where_floats_would_lose_a_cent():
    assert round(1.005 * 100) == 100
    assert cost(CROSS, 1, Site(1, 1.0), replace(PRICES, project=price("1.005"))).lines[-1].amount_cents == 101


def test_an_antenna_without_price_is_named_with_those_that_have_one():
    wide = replace(CROSS, antenna=antenna("320x230"))
    with pytest.raises(ValueError, match=r"no price for antenna '320x230', the list has 60x60, 80x80"):
        cost(wide, 1, Site(1, 1.0), PRICES)


@pytest.mark.parametrize(
    ("readers", "expected"),
    [(1, {4: 1}), (4, {4: 1}), (5, {8: 1}), (8, {8: 1}), (9, {8: 1, 4: 1}), (96, {8: 12})],
)
def test_controllers_of_the_tiny_list(readers, expected):
    chosen = controller_set(readers, PRICES.controllers)
    assert {channels: n for (channels, _), n in chosen} == expected


@settings(deadline=None, derandomize=True, max_examples=300)
@given(
    n_channels=st.integers(1, 14),
    kinds=st.lists(st.tuples(st.integers(1, 9), st.integers(0, 8)), min_size=1, max_size=3),
)
@example(n_channels=8, kinds=[(4, 2), (8, 4)])
def test_no_set_of_controllers_is_cheaper_and_none_as_cheap_has_fewer_pieces(n_channels, kinds):
    controllers = tuple((channels, price(f"{cents / 100:.2f}")) for channels, cents in kinds)
    chosen = controller_set(n_channels, controllers)
    assert sum(channels * n for (channels, _), n in chosen) >= n_channels
    ranges = [range(-(-n_channels // channels) + 1) for channels, _ in kinds]
    best = min(
        (sum(n * cents for n, (_, cents) in zip(counts, kinds, strict=True)), sum(counts))
        for counts in product(*ranges)
        if sum(n * channels for n, (channels, _) in zip(counts, kinds, strict=True)) >= n_channels
    )
    found = (sum(p.amount * n for (_, p), n in chosen) * 100, sum(n for _, n in chosen))
    assert found == best
    assert [c for (c, _), _ in chosen] == sorted((c for (c, _), _ in chosen), reverse=True)


SHELF_PRICES = ShelfPrices(
    currency="EUR",
    reader=price("1450.00", "offer 18"),
    antenna=price("140.00"),
    cabling=price("35.005"),
    tag=price("0.12"),
    attaching=price("0.22"),
    training_minute=price("1.10"),
    localizer_day=price("180.00"),
    localizer_setup=price("900.00"),
    project=price("4800.00"),
)


def test_every_line_of_a_shelf_design_is_quantity_times_price_as_by_hand():
    found = shelf_cost(ShelfEquipment(4, 624, 362.5), 3, SHELF_PRICES)
    assert [(line.group, line.item, line.quantity, line.amount_cents) for line in found.lines] == [
        ("per robot", "UHF reader", 3, 435_000),
        ("per robot", "UHF antenna", 12, 168_000),
        ("per robot", "cabling and mounting of an antenna", 12, 42_006),
        ("per tag", "UHF tag", 624, 7_488),
        ("per tag", "attaching a tag", 624, 13_728),
        ("training", "training drive", Decimal("362.5"), 39_875),
        ("training", "hire of the reference localizer", 2, 36_000),  # a second day is begun after six hours
        ("training", "map for the reference localizer", 1, 90_000),
        ("per project", "project", 1, 480_000),
    ]
    assert found.lines[0].source == "offer 18"


@pytest.mark.parametrize(("minutes", "days"), [(5.0, 1), (360.0, 1), (360.5, 2), (720.0, 2)])
def test_the_localizer_is_hired_for_every_begun_day(minutes, days):
    lines = {line.item: line for line in shelf_cost(ShelfEquipment(4, 10, minutes), 1, SHELF_PRICES).lines}
    assert lines["hire of the reference localizer"].quantity == days
