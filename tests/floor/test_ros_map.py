"""Maps are read as map_server reads them; a bad map is one line that names file and key."""

import struct
import zlib

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from rfiddesign.errors import StudyError
from rfiddesign.floor import OccupancyMap, read_ros_map

KEYS = {
    "image": "map.pgm",
    "resolution": 0.05,
    "origin": [-1.0, 2.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}
GREYS = np.arange(12, dtype=np.uint8).reshape(3, 4) * 20
RAW_PGM = b"P5\n4 3\n255\n" + GREYS.tobytes()


def write_map(folder, content=RAW_PGM, **changes):
    keys = {key: value for key, value in (KEYS | changes).items() if value != "left out"}
    (folder / "map.yaml").write_text(yaml.safe_dump(keys))
    if content is not None:
        (folder / "map.pgm").write_bytes(content)
    return folder / "map.yaml"


def fault_of(path):
    with pytest.raises(StudyError) as caught:
        read_ros_map(path)
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    return caught.value


def test_raw_and_plain_pgm_with_comments_hold_the_same_greys(tmp_path):
    plain = b"P2 # plain\n# made by hand\n4 3\n# white is\n255\n" + b" ".join(b"%d" % g for g in GREYS.ravel())
    commented = b"P5\n#Created with The GIMP\n4 3\n255\n" + GREYS.tobytes()
    for image in (RAW_PGM, plain, commented):
        occupancy_map = read_ros_map(write_map(tmp_path, image))
        assert np.array_equal(occupancy_map.grey, GREYS)
        assert occupancy_map.resolution_m == 0.05
        assert occupancy_map.origin_m_rad == (-1.0, 2.0, 0.0)


def test_png_reads_as_pgm_and_its_alpha_is_ignored(tmp_path):
    for picture in (Image.fromarray(GREYS), Image.merge("LA", [Image.fromarray(GREYS), Image.new("L", (4, 3), 9)])):
        picture.save(tmp_path / "map.png")
        assert np.array_equal(read_ros_map(write_map(tmp_path, None, image="map.png")).grey, GREYS)


def test_sixteen_bit_pgm_is_scaled_to_eight_bits(tmp_path):
    image = b"P5\n4 3\n65535\n" + (GREYS.astype(">u2") * 257).tobytes()
    assert np.array_equal(read_ros_map(write_map(tmp_path, image)).grey, GREYS)


def test_probability_follows_map_server():
    occupancy_map = OccupancyMap("map.yaml", GREYS, 0.1, (0.0, 0.0, 0.0))
    probability = occupancy_map.probability_of_grey()
    assert probability[[0, 255]].tolist() == [1.0, 0.0]
    assert probability[206] == pytest.approx(0.192, abs=5e-4)  # findings 9: below ROS's free threshold of 0.196
    negated = OccupancyMap("map.yaml", GREYS, 0.1, (0.0, 0.0, 0.0), is_negated=True)
    assert negated.probability_of_grey()[[0, 255]].tolist() == [0.0, 1.0]


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("image", "left out"),
        ("resolution", "left out"),
        ("origin", "left out"),
        ("image", 7),
        ("image", ""),
        ("image", "absent.pgm"),
        ("image", "."),
        ("image", "a\0b"),
        ("image", "x" * 5000),
        ("resolution", "5 cm"),
        ("resolution", 0.0),
        ("resolution", -0.1),
        ("resolution", 1e9),
        ("resolution", float("nan")),
        ("resolution", True),
        ("resolution", None),
        ("origin", 3.0),
        ("origin", [0.0, 0.0]),
        ("origin", [0.0, 0.0, "east"]),
        ("origin", [float("inf"), 0.0, 0.0]),
        ("origin", [1e7, 0.0, 0.0]),
        ("negate", 2),
        ("negate", "no way"),
        ("negate", None),
        ("occupied_thresh", 65),
        ("free_thresh", -0.1),
        ("free_thresh", 0.9),
        ("mode", "raw"),
        ("mode", ["scale"]),
        ("resolutoin", 0.1),
    ],
)
def test_a_wrong_key_is_named(tmp_path, key, value):
    assert fault_of(write_map(tmp_path, **{key: value})).key == key


def test_an_image_outside_the_maps_folder_is_refused(tmp_path):
    folder = tmp_path / "floor"
    folder.mkdir()
    (tmp_path / "secret.pgm").write_bytes(RAW_PGM)
    (folder / "link.pgm").symlink_to(tmp_path / "secret.pgm")
    for name in ("../secret.pgm", str(tmp_path / "secret.pgm"), "link.pgm", "../floor/../secret.pgm"):
        fault = fault_of(write_map(folder, None, image=name))
        assert fault.key == "image"
        assert "folder" in fault.problem
    (folder / "below").mkdir()
    (folder / "below" / "map.pgm").write_bytes(RAW_PGM)
    assert read_ros_map(write_map(folder, None, image="below/map.pgm")).grey.shape == (3, 4)


def test_a_missing_map_and_a_folder_are_named(tmp_path):
    assert "No such file" in fault_of(tmp_path / "map.yaml").problem
    assert "directory" in fault_of(tmp_path).problem


@pytest.mark.parametrize(
    "text", [b"", b"[1, 2]", b"image: [", b"\xff\xfe\x00", b"a: b: c", b"[" * 60_000, b"x" * 70_000]
)
def test_a_file_that_is_no_map_yaml_is_refused(tmp_path, text):
    path = tmp_path / "map.yaml"
    path.write_bytes(text)
    fault_of(path)


EMPTY_DATA = b"\0\0\0\4IDATabcd\0\0\0\0"


def png_header(n_columns, n_rows):
    header = b"IHDR" + struct.pack(">IIBBBBB", n_columns, n_rows, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + header + struct.pack(">I", zlib.crc32(header))


@pytest.mark.parametrize(
    "image",
    [
        b"P5 100000 100000 255\n",
        b"P2 10001 10000 255\n",
        b"P5 12000 12000 255\n",
        png_header(100_000, 100_000) + EMPTY_DATA,
    ],
)
def test_an_image_bomb_is_refused_before_its_pixels_are_read(tmp_path, image):
    fault = fault_of(write_map(tmp_path, image))
    assert fault.key == "image"
    assert "100,000,000" in fault.problem


@pytest.mark.parametrize(
    "image",
    [
        b"",
        b"P5",
        b"P5\n4 3\n255\n",
        RAW_PGM[:-1],
        b"P5\n4 0\n255\n",
        b"P5\n4 -3\n255\n" + GREYS.tobytes(),
        b"P5\n4 3\n0\n" + GREYS.tobytes(),
        b"P5\n4 3\n99999\n" + GREYS.tobytes(),
        b"P5\n4444444444444444444 3\n255\n" + GREYS.tobytes(),
        b"P2\n4 3\n255\n1 2 three",
        b"P2\n4 3\n255\n1 2 3 4 5 6 7 8 9 10 11",
        b"P2\n4 3\n255\n1 2 3 4 5 6 7 8 9 10 11 999",
        b"GIF89a not a map",
        png_header(4, 3),
        png_header(4, 3) + EMPTY_DATA,
    ],
)
def test_a_damaged_or_truncated_image_is_named(tmp_path, image):
    fault = fault_of(write_map(tmp_path, image))
    assert fault.key == "image"
    assert "map.pgm" in fault.problem


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_damage_of_an_image_ends_in_a_map_or_one_line(tmp_path, data):
    plain = b"P2\n# c\n4 3\n255\n" + b" ".join(b"%d" % g for g in GREYS.ravel())
    image = bytearray(data.draw(st.sampled_from([RAW_PGM, plain])))
    for position in data.draw(st.lists(st.integers(0, 20), max_size=3)):
        image[position] = data.draw(st.integers(0, 255))
    path = write_map(tmp_path, bytes(image[: data.draw(st.integers(0, len(image)))]))
    try:
        occupancy_map = read_ros_map(path)
    except StudyError:
        fault_of(path)
    else:
        assert occupancy_map.grey.dtype == np.uint8
        assert occupancy_map.grey.size > 0
