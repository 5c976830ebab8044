"""A run has the same numbers, to the last bit, whatever the processor's registers hold."""

import os
import subprocess
import sys

import pytest
from llvmlite import binding

PROGRAM = """
from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.evaluate import evaluate
from rfiddesign.floor import rectangle_floor
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.models.reads import ReadModel
from rfiddesign.simulation import Scenario, World

floor = rectangle_floor(4000.0, 3000.0, 300.0)
world = World(reads=ReadModel(0.9, "staggered"), installation_error_mm=5.0, dead_share=0.1, field_scale=0.95)
design = Design(make_layout("cross-20"), antenna("30x30"), make_pattern("triangular", tags_per_m2=60.0))
for start, n_particles in (("known", 500), ("unknown", 2000)):
    scenario = Scenario(floor, world=world, estimator=Mcl(n_particles=n_particles), start=start, duration_s=5.0)
    print(evaluate(design, scenario, 2, seed=3, n_workers=1).runs)
"""
# Registers of 8 numbers with a fused multiply-add, as on most processors without AVX-512.
HASWELL = {
    "NUMBA_CPU_NAME": "haswell",
    "NUMBA_CPU_FEATURES": "+avx,+avx2,+fma,+bmi,+bmi2,+popcnt,+sse,+sse2,+sse3,+ssse3,+sse4.1,+sse4.2",
}


def printed(tmp_path, **settings):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    environment |= settings | {"NUMBA_CACHE_DIR": str(tmp_path)} if settings else {}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, env=environment, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.mark.slow
def test_a_processor_with_narrower_registers_computes_the_same_runs(tmp_path):
    """Compiles all for another processor: what LLVM lacks there would end the process."""
    features = binding.get_host_cpu_features()
    if not (features.get("avx2") and features.get("fma")):
        pytest.skip("this processor cannot run code for AVX2")
    here = printed(tmp_path)
    assert "RunMetrics" in here
    assert printed(tmp_path, **HASWELL) == here
