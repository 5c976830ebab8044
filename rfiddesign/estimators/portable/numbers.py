"""Every number of a filter for one design, worded for C: those of the design, and the constants of the kernels."""

import math
from collections.abc import Iterable

import numpy as np

from rfiddesign.estimators import _border_kernels as border
from rfiddesign.estimators import _hearing_kernels as hearing
from rfiddesign.estimators import _hypotheses_kernels as hypotheses
from rfiddesign.estimators import _mixture_kernels as mixture
from rfiddesign.estimators import _plane_kernels as plane
from rfiddesign.estimators import _projection_kernels as projection
from rfiddesign.estimators import pmg
from rfiddesign.estimators.verbs import Filter, known
from rfiddesign.floor import TagMap
from rfiddesign.models.soft_field import LEAST_PROBABILITY
from rfiddesign.numerics import _math_kernels as elementary

_DOUBLE = 8


def real(value: float) -> str:
    """A number in double precision, exactly; negative ones in brackets."""
    if not math.isfinite(value):
        raise ValueError(f"{value} cannot be written as a number of C")
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


def single(value: np.float32) -> str:
    """A number in single precision, exactly."""
    text = str(np.float32(value))
    return f"{text}f" if "." in text or "e" in text else f"{text}.0f"


def reals(values: Iterable[float]) -> list[str]:
    """Numbers of an array."""
    return [real(value).strip("()") for value in values]


def numbers_of(ready: Filter, tags: TagMap | None) -> dict[str, object]:
    """What the templates call `n`, by name; `n_tags`, `table_bytes` and `state_bytes` are integers.

    Parameters
    ----------
    ready : a projected-moment Gaussian filter.
    tags : the map; without tags nothing is learned from polls that read nothing.
    """
    antennas, noise, shapes, (table, per_cell, table_reach), rules, looks = ready.model
    softness, chance_to_read, n_most, split_sigma, gate, size, reach, patience = rules
    is_inventory, slots, phases, period, uses_rssi, learns_from_nothing, is_age_compensated, delay = looks
    learns = bool(learns_from_nothing and tags is not None and tags.n_tags)
    map_numbers = _map_numbers(tags) if learns else {"n_tags": 0, "map_bytes": 0}
    return {
        "n_antennas": ready.n_antennas,
        "dt": real(ready.dt_s),
        "n_most": n_most,
        "antennas": [reals(row) for row in antennas],
        "noise": [reals(row) for row in noise],
        "shapes": [reals(row) for row in shapes],
        "table": [reals(row) for row in table],
        "per_cell": real(per_cell),
        "table_reach": real(table_reach),
        "softness": real(softness),
        "chance_to_read": real(chance_to_read),
        "reach": real(reach),
        "size": real(size),
        "split_sigma": real(split_sigma),
        "gate": real(gate),
        "patience": patience,
        "is_age_compensated": int(is_age_compensated),
        "delay_steps": real(delay),
        "uses_rssi": int(uses_rssi),
        "period": int(period),
        "slots": [str(slot) for slot in slots],
        "phases": reals(phases),
        "is_inventory": int(is_inventory),
        "learns_from_nothing": learns,
        "table_bytes": map_numbers["map_bytes"] + table.size * _DOUBLE,
        "state_bytes": _state_bytes(ready.n_antennas, n_most),
        **map_numbers,
        **_constants(),
    }


def _map_numbers(tags: TagMap) -> dict[str, object]:
    """The map in its cells; slots of tags in as few bytes as they need."""
    tag_x, tag_y, cell_start, per_cell, x0, y0, n_x, n_y = known(tags)
    start_bytes = 2 if len(tag_x) < 2**16 else 4
    return {
        "n_tags": len(tag_x),
        "map_bytes": 8 * len(tag_x) + start_bytes * len(cell_start),
        "map_per_cell": real(per_cell),
        "map_x0": real(x0),
        "map_y0": real(y0),
        "map_columns": n_x,
        "map_rows": n_y,
        "start_type": f"uint{8 * start_bytes}_t",
        "tag_x": (single(x) for x in tag_x),
        "tag_y": (single(y) for y in tag_y),
        "cell_start": map(str, cell_start.tolist()),
    }


def _state_bytes(n_antennas: int, n_most: int) -> int:
    """Memory of a state, where a double has 8 bytes and an int 4: see `state.c.jinja`."""
    rows = hypotheses.N_HYPOTHESES + n_most + 4
    grid = 4 * plane.N_GRID + 2 * plane.N_GRID**2 + 2 * hearing.MOST_NEAR
    return rows * _DOUBLE * (mixture.N_COLUMNS + projection.N_FOUND) + 16 + _DOUBLE * (7 * n_antennas + 9 + grid)


def _constants() -> dict[str, object]:
    """Constants of the kernels, the same for every design."""
    return {
        "pi": real(math.pi),
        "log2_e": str(elementary._LOG2_E),
        "ln_2": str(elementary._LN_2),
        "small_turn": real(mixture._SMALL_TURN),
        "split_weight": real(mixture.SPLIT_WEIGHT),
        "split_off": real(mixture.SPLIT_OFF),
        "split_variance": real(mixture.SPLIT_VARIANCE),
        "least_place": real(mixture._LEAST_PLACE),
        "least_heading": real(mixture._LEAST_HEADING),
        "merge_cost": real(mixture._MERGE_COST),
        "least_weight": real(mixture._LEAST_WEIGHT),
        "least_variance": real(projection._LEAST_VARIANCE),
        "farthest": real(border.FARTHEST),
        "per_root_2_pi": real(border._PER_ROOT_2_PI),
        "least_left_across": real(border._LEAST_LEFT),
        "least_blur_across": real(border._LEAST_BLUR),
        "most_bend": real(border._MOST_BEND),
        "widest": real(border._WIDEST),
        "corner": real(border._CORNER),
        "n_grid": plane.N_GRID,
        "half_grid": real(plane.HALF_GRID),
        "half_border": real(plane.HALF_BORDER),
        "least_probability": real(LEAST_PROBABILITY),
        "least_blur": real(plane._LEAST_BLUR),
        "least_left": real(plane._LEAST_LEFT),
        "density": real(plane._DENSITY),
        "nodes": reals(plane._NODES),
        "weights": reals(plane._WEIGHTS),
        "n_hypotheses": hypotheses.N_HYPOTHESES,
        "spacing": real(hypotheses._SPACING),
        "most_near": hearing.MOST_NEAR,
        "vague": real(hearing._VAGUE),
        "kept_in_doubt": hearing._KEPT_IN_DOUBT,
        "share_in_doubt": real(hearing._SHARE_IN_DOUBT),
        "least_total": real(hearing._LEAST_TOTAL),
        "known": reals(pmg._KNOWN),
        "wide_heading": real(pmg._WIDE_HEADING),
        "heading_step": real(pmg._HEADING_STEP),
    }
