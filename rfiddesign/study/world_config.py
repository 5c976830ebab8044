"""What a study file may say of the world: odometry, its faults, readers, installation."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rfiddesign.study.sections import Section, Share


class OdometrySection(Section):
    """Noise of the odometry, by a model of the robot's drive.

    "omnidirectional": white noise of the velocity (hf_multireader_mcl, eq. 1), `noise_mm_per_s` and `noise_rad_per_s`.
    "mecanum": noise that grows with the way, `noise_mm_per_sqrt_m`, `noise_sideways_mm_per_sqrt_m` (as forward unless
    given), `noise_rad_per_sqrt_m`, and with turns, `noise_rad_per_sqrt_rad`.  "differential": noise of two wheels
    `track_mm` apart, `wheel_noise_mm_per_sqrt_m`.
    """

    model: Literal["omnidirectional", "mecanum", "differential"] = "omnidirectional"
    noise_mm_per_s: Annotated[float, Field(ge=0, le=1e5)] | None = None
    noise_rad_per_s: Annotated[float, Field(ge=0, le=1e3)] | None = None
    noise_mm_per_sqrt_m: Annotated[float, Field(ge=0, le=1e5)] | None = None
    noise_sideways_mm_per_sqrt_m: Annotated[float, Field(ge=0, le=1e5)] | None = None
    noise_rad_per_sqrt_m: Annotated[float, Field(ge=0, le=1e3)] | None = None
    noise_rad_per_sqrt_rad: Annotated[float, Field(ge=0, le=1e3)] | None = None
    wheel_noise_mm_per_sqrt_m: Annotated[float, Field(ge=0, le=1e5)] | None = None
    track_mm: Annotated[float, Field(ge=10, le=1e5)] | None = None

    @model_validator(mode="after")
    def _own_noise(self) -> "OdometrySection":
        own = ODOMETRY_KEYS[self.model]
        for key in self.given():
            if key not in own:
                raise ValueError(f"{key} has no meaning for model {self.model!r}, only {', '.join(own)}")
        return self

    def given(self) -> dict[str, float]:
        """The noises that the file gives."""
        return {key: value for key, value in self.model_dump(exclude={"model"}).items() if value is not None}


#: Noises of each model of the odometry.
ODOMETRY_KEYS = {
    "omnidirectional": ("noise_mm_per_s", "noise_rad_per_s"),
    "mecanum": (
        "noise_mm_per_sqrt_m", "noise_sideways_mm_per_sqrt_m", "noise_rad_per_sqrt_m", "noise_rad_per_sqrt_rad",
    ),
    "differential": ("wheel_noise_mm_per_sqrt_m", "track_mm"),
}  # fmt: skip


class FaultsSection(Section):
    """What is systematically wrong with the odometry."""

    scale_x: Annotated[float, Field(ge=-0.5, le=0.5)] = Field(0.0, description="relative error of ways forward")
    scale_y: Annotated[float, Field(ge=-0.5, le=0.5)] = Field(0.0, description="relative error of ways sideways")
    drift_rad_per_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    slips_per_m: Annotated[float, Field(ge=0, le=1000)] = Field(0.0, description="wheel slips per metre of way")
    slip_mm: Annotated[float, Field(ge=0, le=1e4)] = 0.0
    slip_rad: Annotated[float, Field(ge=0, le=3)] = 0.0


class WorldSection(Section):
    """What is true, whatever the estimator believes."""

    odometry: OdometrySection = OdometrySection()
    faults: FaultsSection = FaultsSection()
    read_probability: Share = 1.0
    polling: Literal["common", "staggered", "multiplexed"] = "common"
    poll_s: Annotated[float, Field(ge=1e-5, le=10)] = Field(0.01, description="time of one poll of a multiplexer")
    read_time_s: Annotated[float, Field(ge=0, le=10)] = Field(
        0.0, description="a tag answers if it has been in the field for this long"
    )
    delay_s: Annotated[float, Field(ge=0, le=10)] = Field(0.0, description="how late a read reaches the filter")
    is_delay_known: bool = Field(False, description="whether the filter is told of it")
    answers: Literal["one", "all"] = Field("one", description="tags in view that answer to a poll")
    installation_error_mm: Annotated[float, Field(ge=0, le=1000)] = 0.0
    dead_share: Share = Field(
        0.0, description="share of the tags that never answer, drawn anew in every drive; the estimator does not know"
    )
    field_scale: Annotated[float, Field(ge=0.5, le=2)] = Field(
        1.0, description="size of the true detection fields over the catalogue's, which the estimator believes"
    )
