"""What a study file may say of further scenarios, every one of which must hold: this one with some keys changed."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from rfiddesign.study.sections import Section
from rfiddesign.study.variants_config import ShortName

MAX_SCENARIOS = 20
# What a further scenario may change: how designs are exercised and what is true, but neither filter nor question.
CHANGEABLE = ("scenario", "world")


class FurtherScenario(Section):
    """One more scenario that a design must hold in."""

    name: ShortName = Field(description="unique; the scenario of the study itself is called base")
    set: Annotated[dict[str, Any], Field(min_length=1)] = Field(
        description="keys of [scenario] and [world], dotted or nested, with their values"
    )


def _distinct(scenarios: list[FurtherScenario]) -> list[FurtherScenario]:
    names = ["base", *(scenario.name for scenario in scenarios)]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two are named {name!r}; each needs a name of its own, and one is called base")
    return scenarios


Scenarios = Annotated[list[FurtherScenario], Field(max_length=MAX_SCENARIOS), AfterValidator(_distinct)]
