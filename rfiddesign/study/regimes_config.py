"""What a study file may say of regimes: fleets and floors over which the cheapest certified design is mapped."""

from itertools import pairwise
from typing import Annotated

from pydantic import Field, model_validator

from rfiddesign.study.sections import Section

# What a page can show.
MAX_VALUES = 24

Fleet = Annotated[int, Field(ge=1, le=1_000_000)]
Area = Annotated[float, Field(ge=1, le=1e8, multiple_of=0.01, allow_inf_nan=False)]


class RegimesSection(Section):
    """Sizes of fleets and areas of floors: the map has a cell for each pair."""

    robots: Annotated[list[Fleet], Field(min_length=2, max_length=MAX_VALUES)] = Field(
        description="sizes of fleets, rising; space them evenly in their logarithm"
    )
    areas_m2: Annotated[list[Area], Field(min_length=2, max_length=MAX_VALUES)] = Field(
        description="tagged areas, rising [m2]; space them evenly in their logarithm, by the factor of the fleets"
    )

    @model_validator(mode="after")
    def _rising(self) -> "RegimesSection":
        for name in ("robots", "areas_m2"):
            values = getattr(self, name)
            if any(following <= value for value, following in pairwise(values)):
                raise ValueError(f"{name} is {values}, must rise")
        return self


def check_whole(search: Section) -> None:
    """Raise ValueError for a search that may end before its cheapest design: a map of such answers has no regimes."""
    for name in ("budget_runs", "budget_minutes", "cost_tolerance", "assume"):
        if getattr(search, name):
            raise ValueError(f"regimes needs a search that goes on to the cheapest design, without search.{name}")
