"""The hall of a study with shelves, and the price list of what is put on them."""

from decimal import Decimal
from pathlib import Path

from rfiddesign.cost import Price, ShelfPrices
from rfiddesign.floor.scene import Scene
from rfiddesign.floor.scenes import warehouse
from rfiddesign.study.checked import checked
from rfiddesign.study.config import StudyFile
from rfiddesign.study.price_config import PriceEntry, ShelfPriceFile
from rfiddesign.study.toml_file import read_toml, validate


def hall_of(path: Path, file: StudyFile, tags_per_m: float | None = None) -> Scene:
    """The hall with so many tags per metre of shelf front, the first density of the space unless given.

    Raises
    ------
    StudyError : if no row of shelves fits or there would be too many tags.
    """
    section, (length_m, width_m) = file.shelves, file.floor.rectangle_m
    density = section.space.tags_per_m[0] if tags_per_m is None else tags_per_m
    return checked(
        path,
        "shelves",
        lambda: warehouse(
            1e3 * length_m, 1e3 * width_m, aisle_mm=section.aisle_mm, shelf_depth_mm=section.depth_mm,
            tags_per_m=density, footprint_mm=file.robot.footprint_radius_mm, heights=tuple(section.tag_heights_mm),
        ),
    )  # fmt: skip


def shelf_prices_of(path: Path, file: StudyFile) -> ShelfPrices | None:
    """The price list of a study's shelf designs; None if it has no shelves."""
    if file.shelves is None:
        return None
    place = path.parent / file.shelves.prices
    listed = validate(ShelfPriceFile, read_toml(place, Decimal), place)
    robot, tag, training = listed.per_robot, listed.per_tag, listed.training
    return ShelfPrices(
        currency=listed.currency,
        reader=_price(robot.reader),
        antenna=_price(robot.antenna),
        cabling=_price(robot.cabling),
        tag=_price(tag.tag),
        attaching=_price(tag.attaching),
        training_minute=_price(training.minute),
        localizer_day=_price(training.localizer_day),
        localizer_setup=_price(training.localizer_setup),
        project=_price(listed.per_project),
    )


def _price(entry: PriceEntry) -> Price:
    return Price(entry.price, entry.source)
