"""What a reproduction works out beside the rows of its tables, by the name that its study file gives."""

from collections.abc import Callable

from matplotlib.figure import Figure

from rfiddesign.reproduce.analyses import hf_multireader, navifloor, robustness, smart_floor
from rfiddesign.reproduce.context import Context
from rfiddesign.reproduce.rows import Row


def _nothing(context: Context) -> tuple[list[Row], dict[str, Figure]]:
    return [], {}


ANALYSES: dict[str, Callable[[Context], tuple[list[Row], dict[str, Figure]]]] = {
    "none": _nothing,
    "hf_multireader": hf_multireader.analyse,
    "navifloor": navifloor.analyse,
    "robustness": robustness.analyse,
    "smart_floor": smart_floor.analyse,
}
