"""Reader layouts: where the antennas of a robot sit, in the robot's frame (x forward, y left)."""

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rfiddesign import require

#: More antennas than any robot carries; beyond it a number is a slip of the pen.
MAX_READERS = 10_000


@dataclass(frozen=True)
class ReaderLayout:
    """The antennas of a robot, one per reader.

    Parameters
    ----------
    name : how the layout is called in studies and reports.
    poses : x [mm], y [mm] and yaw [rad] of every antenna in the robot's frame.

    Raises
    ------
    ValueError : if there is no antenna, or a pose is not three finite numbers.
    """

    name: str
    poses: tuple[tuple[float, float, float], ...]

    def __post_init__(self):
        require.count("number of antennas", len(self.poses), at_most=MAX_READERS)
        for number, pose in enumerate(self.poses, start=1):
            if len(pose) != 3:
                raise ValueError(f"poses, antenna {number} = {pose!r}: must be three numbers x, y, yaw")
            for part, value in zip(("x", "y", "yaw"), pose, strict=True):
                require.finite(f"poses, antenna {number}, {part}", value)

    @property
    def poses_mm(self) -> NDArray[np.float64]:
        """Poses (n_readers, 3): x [mm], y [mm], yaw [rad]."""
        return np.array(self.poses, dtype=np.float64)

    @property
    def n_readers(self) -> int:
        """Number of readers, each with one antenna."""
        return len(self.poses)


def cross(
    arms: int = 4,
    readers_per_arm: int = 2,
    first_mm: float = 150.0,
    spacing_mm: float = 100.0,
    width: int = 1,
    width_spacing_mm: float | None = None,
    with_centre: bool = False,
) -> ReaderLayout:
    """Lay equal arms around the centre, the first along x, the others at equal angles; no antenna is turned.

    Parameters
    ----------
    arms : number of arms.
    readers_per_arm : rows of an arm, counted outward.
    first_mm : distance of the first row from the centre [mm].
    spacing_mm : distance between rows [mm].
    width : antennas side by side in a row.
    width_spacing_mm : distance between those [mm]; as `spacing_mm` unless given.
    with_centre : whether a block of width x width antennas fills the centre.
    """
    n_arms = require.count("arms", arms, at_most=MAX_READERS)
    n_rows = require.count("readers_per_arm", readers_per_arm, at_most=MAX_READERS)
    first = require.not_negative("first_mm", first_mm)
    rows = first + require.positive("spacing_mm", spacing_mm) * np.arange(n_rows)
    abreast = _centred("width", width, "width_spacing_mm", spacing_mm if width_spacing_mm is None else width_spacing_mm)
    require.count("number of antennas", n_arms * n_rows * len(abreast), at_most=MAX_READERS)
    arm, along, across = (axis.ravel() for axis in np.meshgrid(np.arange(n_arms), rows, abreast, indexing="ij"))
    cosine, sine = np.cos(2 * math.pi * arm / n_arms), np.sin(2 * math.pi * arm / n_arms)
    x, y = cosine * along - sine * across, sine * along + cosine * across
    if not isinstance(with_centre, bool):
        raise ValueError(f"with_centre = {with_centre!r}: must be true or false")
    if with_centre:
        centre_x, centre_y = np.meshgrid(abreast, abreast, indexing="ij")
        x, y = np.append(x, centre_x), np.append(y, centre_y)
    return _layout("cross", x, y)


def lattice_cross(length: int, width: int, spacing_x_mm: float, spacing_y_mm: float) -> ReaderLayout:
    """Lay a solid cross on one lattice: two bars of `length` x `width` antennas that share the centre."""
    along_x = _centred("length", length, "spacing_x_mm", spacing_x_mm)
    along_y = _centred("length", length, "spacing_y_mm", spacing_y_mm)
    width = require.count("width", width, at_most=len(along_x))
    if (len(along_x) - width) % 2:
        raise ValueError(f"width = {width}: must be even where length = {length} is even and odd where it is odd")
    require.count("number of antennas", width * (2 * len(along_x) - width), at_most=MAX_READERS)
    x, y = np.meshgrid(along_x, along_y, indexing="ij")
    is_in_bar = np.abs(np.arange(len(along_x)) - (len(along_x) - 1) / 2) < width / 2
    is_in_cross = is_in_bar[:, None] | is_in_bar[None, :]
    return _layout("lattice_cross", x[is_in_cross], y[is_in_cross])


def bar(n: int, spacing_mm: float) -> ReaderLayout:
    """Lay `n` antennas in a row across the robot, along y."""
    y = _centred("n", n, "spacing_mm", spacing_mm)
    return _layout("bar", np.zeros_like(y), y)


def grid(n_x: int, n_y: int, spacing_x_mm: float, spacing_y_mm: float) -> ReaderLayout:
    """Lay n_x antennas along x by n_y along y, centred."""
    along_x = _centred("n_x", n_x, "spacing_x_mm", spacing_x_mm)
    along_y = _centred("n_y", n_y, "spacing_y_mm", spacing_y_mm)
    require.count("number of antennas", len(along_x) * len(along_y), at_most=MAX_READERS)
    x, y = np.meshgrid(along_x, along_y, indexing="ij")
    return _layout("grid", x.ravel(), y.ravel())


def ring(n: int, radius_mm: float) -> ReaderLayout:
    """Lay `n` antennas at equal angles on a circle, the first ahead on x, each with its own x axis pointing outward."""
    outward = 2 * math.pi * np.arange(require.count("n", n, at_most=MAX_READERS)) / n
    radius = require.positive("radius_mm", radius_mm)
    return _layout("ring", radius * np.cos(outward), radius * np.sin(outward), outward)


def single() -> ReaderLayout:
    """Lay one antenna at the robot's centre."""
    return ReaderLayout("single", ((0.0, 0.0, 0.0),))


def listed(poses: Sequence[Sequence[float]]) -> ReaderLayout:
    """Lay the antennas at the given poses: x [mm], y [mm] and, if not 0, yaw [rad]."""
    try:
        given = [tuple(pose) for pose in poses]
    except TypeError:
        raise ValueError(f"poses = {poses!r}: must be a list of x, y and, if not 0, yaw") from None
    complete = tuple((*pose, 0.0) if len(pose) == 2 else pose for pose in given)
    return ReaderLayout(f"list-{len(complete)}", complete)


#: The layouts of hf_multireader_mcl, sections 4.1 and 4.2. Its text fixes the numbers of readers and the spacings;
#: the arrangement of the 96 and the 24 is the one that fits figures and sizes best.
LAYOUTS: dict[str, Callable[[], ReaderLayout]] = {
    "cross-96": lambda: lattice_cross(length=14, width=4, spacing_x_mm=44.5, spacing_y_mm=37.5),
    "cross-24": lambda: cross(readers_per_arm=3, first_mm=112.5, spacing_mm=75.0, width=2),
    "cross-20": lambda: lattice_cross(length=6, width=2, spacing_x_mm=75.0, spacing_y_mm=75.0),
    "cross-8": lambda: cross(readers_per_arm=2, first_mm=150.0, spacing_mm=100.0),
}

#: The generators that a study file may name.
LAYOUT_KINDS: dict[str, Callable[..., ReaderLayout]] = {
    "cross": cross,
    "lattice_cross": lattice_cross,
    "bar": bar,
    "grid": grid,
    "ring": ring,
    "single": single,
    "list": listed,
}


def make_layout(spec: str | Mapping[str, object]) -> ReaderLayout:
    """Build the layout that a study asks for.

    Parameters
    ----------
    spec : a name of `LAYOUTS`, or a mapping with a `kind` of `LAYOUT_KINDS`, the arguments of that generator and, if
        wished, a `name`; without one it is the kind and the number of readers, such as "bar-8".

    Raises
    ------
    ValueError : if a name, kind or argument is unknown, missing or out of bounds.
    """
    if isinstance(spec, str):
        if spec not in LAYOUTS:
            raise ValueError(f"layout = {spec!r}: must be one of {', '.join(LAYOUTS)}, or a table with a kind")
        return replace(LAYOUTS[spec](), name=spec)
    arguments = dict(spec)
    kind, name = arguments.pop("kind", None), arguments.pop("name", None)
    if not isinstance(kind, str) or kind not in LAYOUT_KINDS:
        raise ValueError(f"layout kind = {kind!r}: must be one of {', '.join(LAYOUT_KINDS)}")
    parameters = inspect.signature(LAYOUT_KINDS[kind]).parameters
    for key in arguments:
        if key not in parameters:
            allowed = ", ".join(("kind", "name", *parameters))
            raise ValueError(f"layout key = {key!r}: must be one of {allowed} for a layout of kind {kind}")
    for key, parameter in parameters.items():
        if key not in arguments and parameter.default is parameter.empty:
            raise ValueError(f"layout key {key!r} is missing: a layout of kind {kind} needs it")
    layout = LAYOUT_KINDS[kind](**arguments)
    return layout if name is None else replace(layout, name=str(name))


def _centred(count_argument: str, count: object, spacing_argument: str, spacing: object) -> NDArray[np.float64]:
    n = require.count(count_argument, count, at_most=MAX_READERS)
    return (np.arange(n) - (n - 1) / 2) * require.positive(spacing_argument, spacing)


def _layout(kind: str, x: NDArray, y: NDArray, yaw: NDArray | float = 0.0) -> ReaderLayout:
    poses = np.stack(np.broadcast_arrays(x, y, yaw), axis=-1)
    # A quarter turn leaves 1e-14 mm where 0 is meant; adding 0 turns -0 into 0.
    poses[:, :2] = np.round(poses[:, :2], 9) + 0.0
    return ReaderLayout(f"{kind}-{len(poses)}", tuple(tuple(pose) for pose in poses.tolist()))
