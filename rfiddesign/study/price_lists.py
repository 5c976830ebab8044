"""Read price lists: that of tagged floors and that of tagged shelves."""

from decimal import Decimal
from pathlib import Path

from rfiddesign.cost import Price, PriceList, ShelfPrices
from rfiddesign.study.price_config import PriceEntry, PriceFile, ShelfPriceFile
from rfiddesign.study.toml_file import read_toml, validate


def price_list(path: Path) -> PriceList:
    """The price list of tagged floors; StudyError for what is wrong in it."""
    file = validate(PriceFile, read_toml(path, Decimal), path)
    robot, tag, square_metre = file.per_robot, file.per_tag, file.per_m2
    return PriceList(
        currency=file.currency,
        reader=_price(robot.reader),
        antennas=tuple((name, _price(entry)) for name, entry in robot.antenna.items()),
        controllers=tuple((entry.channels, _price(entry)) for entry in robot.controller),
        cabling=_price(robot.cabling),
        tag=_price(tag.tag),
        tag_laying=_price(tag.laying),
        covering_per_m2=_price(square_metre.covering),
        survey_per_m2=_price(square_metre.survey),
        project=_price(file.per_project),
    )


def shelf_price_list(path: Path) -> ShelfPrices:
    """The price list of tagged shelves; StudyError for what is wrong in it."""
    listed = validate(ShelfPriceFile, read_toml(path, Decimal), path)
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
