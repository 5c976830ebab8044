"""What a price list may say: exact decimals, each with where it comes from."""

from decimal import Decimal
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from rfiddesign.study.sections import Name, Section


def _exact(value: Any) -> Decimal:
    if isinstance(value, bool) or not isinstance(value, int | Decimal):
        raise ValueError(f"found {value!r:.60}, must be a number")
    return Decimal(value)


class PriceEntry(Section):
    """A price and where it comes from."""

    price: Annotated[Decimal, BeforeValidator(_exact), Field(ge=0, le=1e9, decimal_places=6)]
    source: Annotated[str, Field(min_length=1, max_length=500)] = Field(description='a source, or "assumption"')


class ControllerEntry(PriceEntry):
    """A controller or multiplexer."""

    channels: Annotated[int, Field(ge=1, le=10_000)]


class PerRobot(Section):
    """Prices counted per reader of each robot."""

    reader: PriceEntry
    cabling: PriceEntry
    antenna: Annotated[dict[Name, PriceEntry], Field(min_length=1)]
    controller: Annotated[list[ControllerEntry], Field(min_length=1, max_length=100)]


class PerTag(Section):
    """Prices counted per tag."""

    tag: PriceEntry
    laying: PriceEntry


class PerSquareMetre(Section):
    """Prices counted per m2 of tagged floor."""

    covering: PriceEntry
    survey: PriceEntry


class PriceFile(Section):
    """A price list."""

    currency: Annotated[str, Field(pattern=r"^[A-Z]{3}$")]
    per_robot: PerRobot
    per_tag: PerTag
    per_m2: PerSquareMetre
    per_project: PriceEntry


class PerShelfRobot(Section):
    """Prices counted per robot that localizes by shelves."""

    reader: PriceEntry
    antenna: PriceEntry
    cabling: PriceEntry


class PerShelfTag(Section):
    """Prices counted per tag on a shelf."""

    tag: PriceEntry
    attaching: PriceEntry


class Training(Section):
    """Prices of training drives and of the reference localizer that they need."""

    minute: PriceEntry
    localizer_day: PriceEntry
    localizer_setup: PriceEntry


class ShelfPriceFile(Section):
    """A price list of localizing by shelves."""

    currency: Annotated[str, Field(pattern=r"^[A-Z]{3}$")]
    per_robot: PerShelfRobot
    per_tag: PerShelfTag
    training: Training
    per_project: PriceEntry
