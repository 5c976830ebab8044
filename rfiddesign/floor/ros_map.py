"""Reading a ROS occupancy map: a small YAML file beside a grey image. Every fault is one StudyError line."""

import math
import struct
import warnings
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from PIL import Image

from rfiddesign.errors import StudyError

MAX_PIXELS = 100_000_000
MAX_YAML_BYTES = 65_536
REQUIRED_KEYS = ("image", "resolution", "origin")
OPTIONAL_KEYS = ("negate", "occupied_thresh", "free_thresh", "mode")
MODES = ("trinary", "scale")


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """A ROS map as it was read.

    Parameters
    ----------
    path : the YAML file, for messages.
    grey : grey values as in the image, row 0 at the top (largest y), shape (n_rows, n_columns), uint8.
    resolution_m : side of a pixel [m].
    origin_m_rad : x [m], y [m] and yaw [rad] of the lower left corner in the map's frame.
    is_negated : whether white is occupied.
    occupied_thresh, free_thresh : ROS's thresholds on the probability of being occupied.
    """

    path: Path
    grey: np.ndarray
    resolution_m: float
    origin_m_rad: tuple[float, float, float]
    is_negated: bool = False
    occupied_thresh: float = 0.65
    free_thresh: float = 0.196

    @property
    def pixel_mm(self) -> float:
        """Side of a pixel [mm]."""
        return self.resolution_m * 1000.0

    def probability_of_grey(self) -> np.ndarray:
        """Probability of being occupied for each of the 256 greys, shape (256,) (map_server's rule)."""
        greys = np.arange(256) / 255.0
        return greys if self.is_negated else 1.0 - greys


def read_ros_map(yaml_path: str | Path) -> OccupancyMap:
    """Read `map.yaml` and the image it names (PGM plain or raw, or PNG; an alpha channel is ignored).

    The image must lie in the folder of the YAML file or below; its size is checked before its pixels are read.

    Raises
    ------
    StudyError
        For every fault of either file, naming the file and the key.
    """
    path = Path(yaml_path)
    keys = _load_yaml(path)
    resolution_m = _number(path, keys, "resolution", 0.001, 10.0)
    origin_m_rad = _origin(path, keys["origin"])
    is_negated = keys.get("negate", 0)
    if is_negated not in (0, 1):
        raise StudyError(f"is {is_negated!r}; allowed are 0 and 1", file=path, key="negate")
    mode = keys.get("mode", "trinary")
    if mode not in MODES:
        raise StudyError(f"is {mode!r}; allowed are {', '.join(MODES)}", file=path, key="mode")
    occupied_thresh = _number(path, keys, "occupied_thresh", 0.0, 1.0, default=0.65)
    free_thresh = _number(path, keys, "free_thresh", 0.0, 1.0, default=0.196)
    if free_thresh > occupied_thresh:
        problem = f"is {free_thresh:g}; allowed is at most occupied_thresh, {occupied_thresh:g}"
        raise StudyError(problem, file=path, key="free_thresh")
    return OccupancyMap(
        path=path,
        grey=_read_grey(path, _image_path(path, keys["image"])),
        resolution_m=resolution_m,
        origin_m_rad=origin_m_rad,
        is_negated=bool(is_negated),
        occupied_thresh=occupied_thresh,
        free_thresh=free_thresh,
    )


def _load_yaml(path: Path) -> dict:
    try:
        with path.open("rb") as stream:
            text = stream.read(MAX_YAML_BYTES + 1)
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror or error}", file=path) from None
    if len(text) > MAX_YAML_BYTES:
        raise StudyError(f"is larger than {MAX_YAML_BYTES} bytes: not a map's YAML file", file=path)
    try:
        keys = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as error:
        raise StudyError(f"is not YAML: {str(error) or type(error).__name__}", file=path) from None
    if not isinstance(keys, dict):
        raise StudyError(f"holds no keys; needed are {', '.join(REQUIRED_KEYS)}", file=path)
    allowed = REQUIRED_KEYS + OPTIONAL_KEYS
    for key in keys:
        if key not in allowed:
            raise StudyError(f"unknown key; allowed are {', '.join(allowed)}", file=path, key=str(key)[:80])
    for key in REQUIRED_KEYS:
        if key not in keys:
            raise StudyError(f"is missing; needed are {', '.join(REQUIRED_KEYS)}", file=path, key=key)
    return keys


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < math.inf


def _number(path: Path, keys: dict, key: str, low: float, high: float, default: float | None = None) -> float:
    value = keys.get(key, default)
    if not _is_number(value) or not low <= value <= high:
        raise StudyError(f"is {value!r:.60}; allowed is a number from {low:g} to {high:g}", file=path, key=key)
    return float(value)


def _origin(path: Path, value: object) -> tuple[float, float, float]:
    is_pose = isinstance(value, list) and len(value) == 3 and all(_is_number(v) and abs(v) <= 4000.0 for v in value)
    if not is_pose:
        problem = f"is {value!r:.60}; allowed are three numbers x [m], y [m], yaw [rad] within 4000"
        raise StudyError(problem, file=path, key="origin")
    return tuple(float(v) for v in value)


def _image_path(yaml_path: Path, value: object) -> Path:
    if not isinstance(value, str) or not value or "\0" in value:
        raise StudyError(f"is {value!r:.60}; allowed is a file name", file=yaml_path, key="image")
    try:
        folder = yaml_path.parent.resolve()
        image_path = (folder / value).resolve()
        is_file = image_path.is_file()
    except (OSError, RuntimeError) as error:
        raise StudyError(f"is {value!r:.60}: {error}", file=yaml_path, key="image") from None
    if not image_path.is_relative_to(folder):
        raise StudyError(f"is {value!r:.200}; the image must lie in the folder of the map", file=yaml_path, key="image")
    if not is_file:
        raise StudyError(f"is {value!r:.200}: there is no such file", file=yaml_path, key="image")
    return image_path


def _read_grey(yaml_path: Path, image_path: Path) -> np.ndarray:
    """Read an image as 8-bit grey. Pillow reads the header first, so its size is judged before memory is taken."""

    def fault(problem: str) -> StudyError:
        return StudyError(f"{image_path.name}: {problem}", file=yaml_path, key="image")

    too_large = f"has too many pixels; allowed are {MAX_PIXELS:,}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(image_path, formats=("PPM", "PNG")) as image:
                n_columns, n_rows = image.size
                if n_columns * n_rows > MAX_PIXELS:
                    raise fault(f"{n_columns} x {n_rows} {too_large}")
                return _as_grey(image)
    except Image.DecompressionBombError:
        raise fault(too_large) from None
    except Image.UnidentifiedImageError:
        raise fault("is neither a PGM nor a PNG image") from None
    except StudyError:
        raise
    except (OSError, ValueError, SyntaxError, EOFError, IndexError, KeyError, struct.error, zlib.error) as error:
        raise fault(f"cannot be read, perhaps truncated: {error}") from None


def _as_grey(image: Image.Image) -> np.ndarray:
    if image.mode.startswith("I"):  # 16-bit images: Pillow scales them to 0..65535
        return (np.clip(np.asarray(image, dtype=np.int64), 0, 65535) // 257).astype(np.uint8)
    return np.array(image.convert("L"), dtype=np.uint8)
