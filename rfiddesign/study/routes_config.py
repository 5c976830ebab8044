"""What a study file may say of routes: stations that robots drive between, and tags placed along the ways."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rfiddesign.study.sections import NotNegative, Positive, Section

Coordinate = Annotated[float, Field(ge=-5000, le=5000, allow_inf_nan=False)]
Station = Annotated[list[Coordinate], Field(min_length=2, max_length=2)]


class RoutesSection(Section):
    """Stations, the routes between them, and how tags are placed along these."""

    stations: Annotated[int, Field(ge=2, le=200)] | None = Field(
        None, description="how many stations to spread over the floor"
    )
    stations_m: Annotated[list[Station], Field(min_length=2, max_length=200)] | None = Field(
        None, description="where the stations are [m], in the floor's frame"
    )
    joins: Literal["all", "spanning"] = Field(
        "all", description="which stations have a way of their own: all pairs, or those of a shortest spanning tree"
    )
    clearance_mm: Annotated[float, Field(ge=0, le=10_000)] = Field(
        300.0, description="clearance that routes prefer, beyond the footprint"
    )
    cell_mm: Annotated[float, Field(ge=10, le=1000)] = Field(100.0, description="cells that routes are searched on")
    lateral_mm: Annotated[float, Field(ge=0, le=1000)] = Field(
        50.0, description="robots drive up to this beside their route, to either side"
    )
    yaw_deg: Annotated[float, Field(ge=0, le=45)] = Field(
        3.0, description="robots are turned off their route by up to this, to either side"
    )
    distances_mm: Annotated[list[Positive], Field(min_length=1, max_length=50)] = Field(
        [500.0], description='pattern "routes": a robot reads a tag within this driven distance; each value is tried'
    )
    delta_mm: Positive = Field(50.0, description="step between the windows of travel that are served")
    n_spare: Annotated[int, Field(ge=0, le=9)] = Field(
        1, description="tags of any window that may be dead: it stays served"
    )
    n_laterals: Annotated[int, Field(ge=1, le=51)] = Field(
        3, description="places beside the route, evenly up to lateral_mm, at which windows are served"
    )
    is_in_lines: bool = Field(False, description="tags lie in lines that an installer can lay")
    along_mm: Positive = Field(50.0, description="places for tags, step along a route")
    across_mm: Positive = Field(25.0, description="places for tags, step across a route")
    margin_mm: NotNegative = Field(1.0, description="a tag counts as seen this deep in an antenna's area only")
    search_rounds: Annotated[int, Field(ge=0, le=1_000_000_000)] = Field(
        20_000, description="length of the search for fewer tags, of each layout, antenna and distance"
    )

    @model_validator(mode="after")
    def _one_kind_of_stations(self) -> "RoutesSection":
        if (self.stations is None) == (self.stations_m is None):
            raise ValueError("needs exactly one of stations and stations_m")
        return self

    @model_validator(mode="after")
    def _distances(self) -> "RoutesSection":
        if len(set(self.distances_mm)) < len(self.distances_mm):
            raise ValueError(f"distances_mm is {self.distances_mm}, must not name a distance twice")
        if min(self.distances_mm) <= self.delta_mm:
            raise ValueError(f"distances_mm is {self.distances_mm}, must be above delta_mm, {self.delta_mm:g}")
        return self
