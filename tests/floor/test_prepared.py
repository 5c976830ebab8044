"""Floors are shared by threads; GEOS's indices are not."""

import subprocess
import sys

MANY_THREADS = """
import sys
from concurrent.futures import ThreadPoolExecutor
import shapely
from rfiddesign.floor import Floor, random_route
from rfiddesign.geometry import make_pattern

ring = shapely.Point(20_000, 20_000).buffer(9_000, quad_segs=1000)
plan = shapely.to_wkb(ring.difference(shapely.Point(20_000, 20_000).buffer(3_000, quad_segs=1000)))
pattern = make_pattern("random", tags_per_m2=1.0)
with ThreadPoolExecutor(8) as pool:
    for _ in range(10):
        floor = Floor("ring", shapely.from_wkb(plan), shapely.from_wkb(plan), "test")
        routes = pool.map(lambda i: random_route(floor, i, 3e3, is_aligned=True), range(16))
        n_tags = pool.map(lambda _: len(pattern.lay(floor.drivable)), range(8))
        assert len(set(n_tags)) == 1
        list(routes)
"""


def test_threads_may_draw_routes_and_lay_tags_on_one_floor():
    """In a process of its own: what this guards against is a crash of the interpreter."""
    done = subprocess.run([sys.executable, "-c", MANY_THREADS], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-500:]
