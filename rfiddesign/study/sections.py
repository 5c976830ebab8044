"""What every table of a study file has: its checks, and the ranges that many keys share."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Density = Annotated[float, Field(gt=0, le=10_000, allow_inf_nan=False)]
Pitch = Annotated[float, Field(ge=10, le=100_000, allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=100, pattern=r"^[^\x00-\x1f\x7f]+$")]
PatternKind = Literal["square", "triangular", "random", "striped", "staggered", "thinned"]
RoutePatternKind = Literal["routes", "square-on-routes", "triangular-on-routes", "random-on-routes"]


class Section(BaseModel):
    """A table of the file: unknown keys and wrong types are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)
