"""What a study file may say of its variants: studies that differ from it in some keys, to be compared."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from rfiddesign.study.sections import Name, Section

MAX_VARIANTS = 200

ShortName = Annotated[Name, Field(max_length=60)]


class VariantSection(Section):
    """A variant: this study with some of its keys set otherwise."""

    name: ShortName = Field(description="unique; names the variant's folder")
    group: ShortName | None = Field(None, description="row of the comparison; default: the name")
    condition: Annotated[str, Field(max_length=60, pattern=r"^[^\x00-\x1f\x7f]*$")] = Field(
        "", description="column of the comparison"
    )
    set: dict[str, Any] = Field({}, description="keys of this study file, dotted or nested, with their values")

    @property
    def row(self) -> str:
        """The group that the variant is compared in."""
        return self.group if self.group is not None else self.name


class ComparisonSection(Section):
    """How the variants are compared."""

    base: ShortName | None = Field(None, description="group that savings are counted against; default: the first")


def _distinct(variants: list[VariantSection]) -> list[VariantSection]:
    names: set[str] = set()
    cells: dict[tuple[str, str], str] = {}
    for variant in variants:
        if variant.name in names:
            raise ValueError(f"two are named {variant.name!r}; each needs a name of its own")
        names.add(variant.name)
        cell = (variant.row, variant.condition)
        if cell in cells:
            raise ValueError(
                f"{cells[cell]!r} and {variant.name!r} have the same group {cell[0]!r} and condition {cell[1]!r}; each"
                " pair may occur once"
            )
        cells[cell] = variant.name
    return variants


Variants = Annotated[list[VariantSection], Field(max_length=MAX_VARIANTS), AfterValidator(_distinct)]
