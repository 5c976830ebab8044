"""The models of a tag mapping's study file, ready to map."""

import math

import numpy as np

from rfiddesign.estimators.tag_mapping.by_field import ByField
from rfiddesign.estimators.tag_mapping.by_reads import ByReads
from rfiddesign.estimators.tag_mapping.likelihood import AdaptiveLikelihood, FixedLikelihood
from rfiddesign.models.lobe import Lobe
from rfiddesign.reproduce.tag_mapping.config import FieldSection, MappingSection

FIXED, ADAPTIVE, FIELD, WITH_DISTANCES = "fixed", "adaptive", "field", "field_distances"
#: What the models are called where they are drawn.
NAMES = {
    FIXED: "fixed likelihood",
    ADAPTIVE: "adaptive likelihood",
    FIELD: "read field",
    WITH_DISTANCES: "read field, distances",
}


def papers_models(section: MappingSection, ellipse_mm: float | None = None) -> dict[str, ByReads]:
    """The fixed and the adaptive model; `ellipse_mm` in place of the lengths of fixed ellipse and expanded range."""
    fixed = FixedLikelihood(ellipse_mm or section.fixed_mm, section.core, section.outside, section.ratio)
    adaptive = AdaptiveLikelihood(
        ellipse_mm or section.expanded_mm, section.core, section.expanded, section.outside, section.redundancy,
        section.ratio,
    )  # fmt: skip
    return {
        name: ByReads(likelihood, section.cell_mm, section.radius_mm)
        for name, likelihood in ((FIXED, fixed), (ADAPTIVE, adaptive))
    }


def papers_lobe(section: MappingSection) -> Lobe:
    """The reader of the paper: it reads all tags within its ellipse."""
    return Lobe(ratio=section.ratio)


def mountings(section: MappingSection) -> np.ndarray:
    """Poses (m, 3) of the antennas on the robot, all in its middle."""
    return np.array([(0.0, 0.0, math.radians(side)) for side in section.sides_deg])


def fitted(section: MappingSection, field: FieldSection) -> MappingSection:
    """The mapping with ellipses of the shape that goes with a field."""
    return section if field.ratio is None else section.model_copy(update={"ratio": field.ratio})


def lobes(section: MappingSection, field: FieldSection) -> tuple[Lobe, Lobe]:
    """A read field in its world, and as it is believed to be."""
    true = Lobe(field.shape, section.ratio, field.beam_deg, field.softness, field.read_probability)
    believed = Lobe(
        field.shape, section.ratio, field.beam_deg, field.believed_softness, field.believed_read_probability
    )
    return true, believed


def field_models(section: MappingSection, believed: Lobe) -> dict[str, ByField]:
    """The posterior by read field, which takes all reads to be alike or uses the distances at which they came."""
    distances = tuple(section.distances_mm)
    field = believed.log_field(distances, section.cell_mm)
    return {
        name: ByField(field, used, section.cell_mm, section.radius_mm)
        for name, used in ((FIELD, ()), (WITH_DISTANCES, distances))
    }
