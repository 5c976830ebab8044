"""What a reproduction measured."""

from dataclasses import dataclass, field

from matplotlib.figure import Figure

from rfiddesign.reproduce.rows import Row


@dataclass(frozen=True)
class Measured:
    """What the kind of a reproduction found.

    Parameters
    ----------
    rows : every number, published or not.
    figures : by name.
    files : texts to be written beside them, by file name.
    """

    rows: list[Row]
    figures: dict[str, Figure]
    files: dict[str, str] = field(default_factory=dict)
