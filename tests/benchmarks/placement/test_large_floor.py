"""Memory and time of placing tags on 100,000 m2, projected from tiles that are measured.

The office's routes are laid side by side; placement splits such a floor into parts by itself.  Each size is measured in
a process of its own, whose peak is its alone.  Run by name: ``pytest tests/benchmarks/placement -s``.
"""

import json
import subprocess
import sys

PROGRAM = """
import json, resource, sys, time
from rfiddesign.catalog import antenna
from rfiddesign.floor import bundled_routes
from rfiddesign.geometry import make_layout
from rfiddesign.optimize.tag_placement import PlacementRules
from rfiddesign.optimize.tag_placement.choose import choose_tags
from rfiddesign.study import load_study
from rfiddesign.study.load import floor_of

n_tiles = int(sys.argv[1])
floor = floor_of(load_study("studies/willow-office"))
office = bundled_routes(floor, 20, 320.0).edges_mm
routes = [route + [80e3 * tile, 0.0] for tile in range(n_tiles) for route in office]
rules = PlacementRules(distance_mm=500.0, n_search_rounds=20_000 * n_tiles)
begin = time.process_time()
tags = choose_tags(routes, make_layout("cross-8"), antenna("60x60").area, rules, None, 0)
peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
print(json.dumps([floor.area_m2, len(tags), peak_mb, time.process_time() - begin]))
"""
# Powers of two: the parts, made by halving, are then of one size.
SMALL, LARGE, PROJECTED_M2 = 4, 16, 100_000.0


def measured(n_tiles: int) -> tuple[float, int, float, float]:
    """Area of a tile [m2], tags, peak memory [MB] and seconds of processor time for so many tiles."""
    done = subprocess.run([sys.executable, "-c", PROGRAM, str(n_tiles)], capture_output=True, text=True, check=True)
    return tuple(json.loads(done.stdout))


def test_a_large_floor_is_placed_by_parts_in_less_than_2_gb():
    area_m2, few_tags, small_mb, small_s = measured(SMALL)
    _, many_tags, large_mb, large_s = measured(LARGE)
    n_tiles = PROJECTED_M2 / area_m2
    per_tile_mb, per_tile_s = ((b - a) / (LARGE - SMALL) for a, b in ((small_mb, large_mb), (small_s, large_s)))
    peak_mb, seconds = (at + (n_tiles - LARGE) * each for at, each in ((large_mb, per_tile_mb), (large_s, per_tile_s)))
    print(
        f"\n{SMALL} tiles of {area_m2:,.0f} m2: {few_tags:,} tags, {small_mb:,.0f} MB, {small_s:.0f} s; {LARGE} tiles:"
        f" {many_tags:,} tags, {large_mb:,.0f} MB, {large_s:.0f} s; projected to {PROJECTED_M2:,.0f} m2"
        f" ({n_tiles:.0f} tiles): {peak_mb:,.0f} MB, {seconds / 60:.0f} min"
    )
    # Parts do not end where tiles do, so that tiles differ by a few tags.
    assert abs(many_tags / few_tags / (LARGE / SMALL) - 1) < 0.03
    assert peak_mb < 2000
