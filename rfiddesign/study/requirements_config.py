"""What a study file may ask of all drives together, beside the limits that each drive must keep."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rfiddesign.study.sections import Positive, Section

MetricName = Literal[
    "position_mean_mm", "position_rms_mm", "position_p95_mm", "position_max_mm",
    "heading_mean_deg", "heading_rms_deg", "heading_p95_deg", "heading_max_deg",
    "lost_share", "convergence_s",
]  # fmt: skip

# A design holds that keeps this much below a limit on a mean.
HOLD_SHARE = 0.9
# Errors beyond these multiples of the limit count as that much: a mean of what has no bound can be proved by nothing.
MEAN_CAP, RMS_CAP = 4.0, 2.0


class FurtherRequirement(Section):
    """A limit on the mean, the root mean square or a quantile of a metric over all drives."""

    kind: Literal["mean", "rms", "quantile"]
    metric: MetricName = Field(description="what is measured of each drive, in its own unit")
    limit: Positive = Field(description="a certified design keeps below this, in the metric's unit")
    hold_limit: Positive | None = Field(
        None, description="mean, rms: a design holds if it keeps at or below this; default: 0.9 of the limit"
    )
    cap: Positive | None = Field(
        None,
        description="mean, rms: a drive that measures more counts as this much; default: 4 limits, 2 for rms",
    )
    quantile: Annotated[float, Field(gt=0, lt=1)] | None = Field(
        None, description="quantile: a certified design keeps the limit in more than this share of drives"
    )
    hold_quantile: Annotated[float, Field(gt=0, lt=1)] | None = Field(
        None, description="quantile: a design holds that keeps the limit in this share; default: half way to 1"
    )

    @model_validator(mode="after")
    def _fits_kind(self) -> "FurtherRequirement":
        own = {"quantile", "hold_quantile"} if self.kind == "quantile" else {"hold_limit", "cap"}
        for key in ("quantile", "hold_quantile", "hold_limit", "cap"):
            if key not in own and getattr(self, key) is not None:
                raise ValueError(f"{key} is not for kind = {self.kind!r}")
        if self.kind == "quantile":
            if self.quantile is None:
                raise ValueError("needs quantile")
            if not self.quantile < self.holds_in:
                raise ValueError(f"hold_quantile must be above quantile = {self.quantile:g}")
        else:
            if not self.holds_at < self.limit:
                raise ValueError(f"hold_limit must be below limit = {self.limit:g}")
            if not self.limit < self.most:
                raise ValueError(f"cap must be above limit = {self.limit:g}")
        return self

    @property
    def holds_at(self) -> float:
        """A design holds whose mean is at most this."""
        return HOLD_SHARE * self.limit if self.hold_limit is None else self.hold_limit

    @property
    def most(self) -> float:
        """What a drive counts at most."""
        return self.limit * (RMS_CAP if self.kind == "rms" else MEAN_CAP) if self.cap is None else self.cap

    @property
    def holds_in(self) -> float:
        """A design holds that keeps the limit in this share of drives."""
        return (1 + self.quantile) / 2 if self.hold_quantile is None else self.hold_quantile
