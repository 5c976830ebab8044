"""The exported C file does what the kernels do: recorded drives replayed in both, step by step."""

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from rfiddesign.catalog import Antenna, antenna
from rfiddesign.design import Design
from rfiddesign.estimators import pmg, registry
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.estimators.pmg import Pmg
from rfiddesign.estimators.portable import Words, c_source
from rfiddesign.estimators.start import KnownStart, Start, UncertainStart, UnknownStart
from rfiddesign.floor import TagMap, build_tag_map, rectangle_floor
from rfiddesign.geometry import ProbabilityMap, ReaderLayout, listed, make_layout, make_pattern
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.recording import Recording
from rfiddesign.models.robot import Robot
from rfiddesign.simulation.record import record_with
from rfiddesign.simulation.run import PreparedDesign, key_of, prepare, start_of, true_poses
from rfiddesign.simulation.scenario import Routes, Scenario, World

GCC = shutil.which("gcc")
needs_gcc = pytest.mark.skipif(GCC is None, reason="no gcc on this machine")
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wdouble-promotion", "-Werror", "-O1")
AS_TOLD = "-O2"  # what the head of the file tells a user; compiling takes twice as long

FLOOR = rectangle_floor(5000.0, 4000.0, 300.0)
WORDS = Words("hall", "a hall", "a design", FLOOR.navigable_bounds)
YAWED = listed([(150.0, 0.0, 0.0), (-100.0, 200.0, 0.7), (0.0, -180.0, -2.2)])
PMG, STAGGERED = Pmg(), ReadModel(polling="staggered")
CROSS_8, SMALL = make_layout("cross-8"), antenna("60x60")
MEASURED = Antenna("table", (1.0, 1.0), ProbabilityMap([[0.9, 0.1, 0.3, 0.0], [0.6, 1.0, 0.4, 1.0]], 60.0), "test")


@dataclass(frozen=True)
class Case:
    """A design on a floor, and how its robot drives and starts."""

    layout: ReaderLayout = CROSS_8
    antenna: Antenna = SMALL
    tags_per_m2: float = 100.0
    reads: ReadModel = STAGGERED
    filter_: Pmg = PMG
    world: tuple = ()
    start: str = "known"
    is_delay_known: bool = False
    duration_s: float = 20.0
    pattern: str = "square"

    def drive(self) -> tuple[PreparedDesign, TagMap, Recording, Start]:
        """The robot, its tags, and what it recorded."""
        design = Design(self.layout, self.antenna, make_pattern(self.pattern, tags_per_m2=self.tags_per_m2))
        scenario = Scenario(
            FLOOR, Routes((200.0,), aligned_share=0.0), World(reads=self.reads, **dict(self.world)), self.filter_,
            self.start, duration_s=self.duration_s, is_delay_known=self.is_delay_known,
        )  # fmt: skip
        prepared, poses, key = prepare(design, scenario), true_poses(scenario, 3, 0), key_of(3, 0)
        tags = build_tag_map(design.pattern.lay(FLOOR.drivable))
        recording = record_with(prepared.rig, tags, poses, scenario.dt_s, key)
        return prepared, tags, recording, start_of(scenario, poses)


CASES = {
    "disc": Case(),
    "few tags, unknown start": Case(tags_per_m2=16.0, start="unknown", duration_s=40.0),
    "rectangle, yawed": Case(YAWED, antenna("320x230"), 9.0),
    "rectangle, yawed, unknown start": Case(YAWED, antenna("320x230"), 9.0, start="unknown"),
    "rings of RSSI": Case(YAWED, antenna("navifloor"), 16.0),
    "rings of RSSI that are not used": Case(YAWED, antenna("navifloor"), 16.0, filter_=Pmg(uses_rssi=False)),
    "table of chances": Case(YAWED, MEASURED, 25.0),
    "table of chances, unknown start": Case(YAWED, MEASURED, 25.0, start="unknown"),
    "multiplexed": Case(reads=ReadModel(polling="multiplexed", poll_s=0.02)),
    "multiplexed inventories, late": Case(
        YAWED, antenna("320x230"), 25.0, ReadModel(0.8, "multiplexed", 0.1, 0.02, 0.08, "all"), is_delay_known=True
    ),
    "inventories": Case(YAWED, antenna("320x230"), 25.0, ReadModel(0.9, answers="all")),
    "delay": Case(reads=ReadModel(delay_s=0.08, polling="staggered"), is_delay_known=True),
    "ages not compensated": Case(filter_=Pmg(is_age_compensated=False, n_components=1)),
    "reads alone": Case(filter_=Pmg(learns_from_nothing=False)),
    "random tags": Case(pattern="random", start="unknown"),
    "faults that the filter does not know of": Case(
        world=(("installation_error_mm", 15.0), ("dead_share", 0.2), ("field_scale", 1.3)), start="unknown",
        filter_=Pmg(OmnidirectionalMotion(5.0, 5.0, 0.01), softness_mm=2.0, radius_tolerance=0.05, patience=2),
    ),
}  # fmt: skip


def compiled(text: str, folder: Path, *options: str) -> Path:
    """The replay program of an exported file."""
    source, program = folder / "rfid_pmg.c", folder / "replay"
    source.write_text(text)
    command = [GCC, *STRICT, *options, "-DPMG_REPLAY_MAIN", source, "-lm", "-o", program]
    found = subprocess.run(command, capture_output=True, text=True)
    assert (found.returncode, found.stderr) == (0, "")
    return program


def log_of(recording: Recording) -> str:
    """A recording as the replay program reads it."""
    lines = []
    for t, increment in enumerate(recording.odometry.tolist()):
        rows = range(recording.read_start[t], recording.read_start[t + 1])
        words = [*map(repr, increment), str(len(rows))]
        for row in rows:
            numbers = (*recording.read_tag_mm[row].tolist(), float(recording.read_age_s[row]))
            words += [str(recording.read_antenna[row]), *map(repr, numbers), str(recording.read_rssi[row])]
        lines.append(" ".join(words))
    return "\n".join(lines) + "\n"


def without_steps(recording: Recording, first: int, last: int) -> Recording:
    """A recording in which the robot was carried from where step `first` began to where step `last` did."""
    starts = recording.read_start
    kept = np.r_[0 : starts[first], starts[last] : starts[-1]]
    counts = np.diff(starts)
    return Recording(
        recording.dt_s,
        np.concatenate([recording.true_poses[: first + 1], recording.true_poses[last + 1 :]]),
        np.concatenate([recording.odometry[:first], recording.odometry[last:]]),
        np.concatenate([[0], np.cumsum(np.r_[counts[:first], counts[last:]])]),
        recording.read_antenna[kept],
        recording.read_tag[kept],
        recording.read_tag_mm[kept],
        recording.read_age_s[kept],
        recording.read_rssi[kept],
    )


def words_of(start: Start) -> list[str]:
    """A start as the replay program takes it."""
    if isinstance(start, KnownStart):
        return ["known", *(repr(float(value)) for value in start.pose)]
    if isinstance(start, UnknownStart):
        return ["unknown", *(repr(float(value)) for value in start.bounds_mm)]
    covariance = np.array(start.covariance, float)[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return ["uncertain", *(repr(float(value)) for value in (*start.pose, *covariance))]


def replayed(program: Path, words: list[str], log: str) -> np.ndarray:
    """Estimates (n_steps, 9) of the replay program."""
    found = subprocess.run([program, *words], input=log, capture_output=True, text=True)
    assert (found.returncode, found.stderr) == (0, "")
    return np.array([line.split() for line in found.stdout.splitlines()], float)


def tracked(prepared: PreparedDesign, tags: TagMap, recording: Recording, start: Start) -> np.ndarray:
    """Estimates (n_steps, 9) of the kernels."""
    state = registry.init(prepared.ready, start, 3)
    estimates = np.zeros((recording.n_steps + 1, 10))
    pmg.track(prepared.ready, state, recording, recording.n_steps, estimates, tags)
    return estimates[1:, :9]


def assert_are_the_same(found: np.ndarray, expected: np.ndarray) -> None:
    """Every number of every step: the mean within 1e-5 mm and 1e-5 of the heading's sigma, covariances within 1e-5 of
    the product of the two sigmas that they are of."""
    assert found.shape == expected.shape
    sigmas = np.sqrt(expected[:, [3, 5, 8]])
    x, y, heading = sigmas.T
    allowed = np.column_stack([np.ones_like(x), np.ones_like(x), heading, x * x, x * y, y * y, x * heading, y * heading,
                               heading * heading])  # fmt: skip
    excess = np.abs(found - expected) / allowed
    step, column = np.unravel_index(np.argmax(excess), excess.shape)
    assert excess.max() <= 1e-5, f"step {step}, column {column}: {found[step]} in C, {expected[step]} by the kernels"


@needs_gcc
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_file_estimates_what_the_kernels_do_at_every_step(case, tmp_path):
    """Of drives with reads of each kind; compiled with all warnings as errors."""
    prepared, tags, recording, start = case.drive()
    assert recording.n_reads > 80
    program = compiled(c_source(prepared.ready, tags, WORDS).text, tmp_path, AS_TOLD)
    found = replayed(program, words_of(start), log_of(recording))
    assert_are_the_same(found, tracked(prepared, tags, recording, start))
    # The comparison is of drives that the filter can follow, not of one lost robot with another.
    assert np.median(np.hypot(*(found[-100:, :2] - recording.true_poses[-100:, :2]).T)) < 60.0


@needs_gcc
@pytest.mark.parametrize("sigma_rad", [0.1, 0.5, 3.0], ids=["narrow", "wide", "any heading"])
def test_an_uncertain_start_is_the_same(sigma_rad, tmp_path):
    """A wide heading is split, with what position and heading share."""
    prepared, tags, recording, known = Case().drive()
    slope, heading = np.array([-40.0, 90.0]), sigma_rad**2
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = np.diag([400.0, 225.0]) + np.outer(slope, slope) * heading
    covariance[:2, 2] = covariance[2, :2] = slope * heading
    covariance[2, 2] = heading
    start = UncertainStart(known.pose, tuple(map(tuple, covariance.tolist())))
    program = compiled(c_source(prepared.ready, tags, WORDS).text, tmp_path)
    found = replayed(program, words_of(start), log_of(recording))
    assert_are_the_same(found, tracked(prepared, tags, recording, start))


@needs_gcc
def test_a_robot_that_was_carried_away_finds_itself_at_the_same_steps(tmp_path):
    """Steps 100 to 249 of a drive are left out: reads contradict the belief until the filter starts again."""
    prepared, tags, whole, start = Case(duration_s=30.0).drive()
    recording = without_steps(whole, 100, 250)
    program = compiled(c_source(prepared.ready, tags, WORDS).text, tmp_path)
    found = replayed(program, words_of(start), log_of(recording))
    assert_are_the_same(found, tracked(prepared, tags, recording, start))
    error = np.hypot(*(found[:, :2] - recording.true_poses[1:, :2]).T)
    assert error[:100].max() < 15.0
    assert error[100] > 200.0
    assert error[-1] < 15.0


@needs_gcc
@pytest.mark.parametrize("name", ["disc", "table of chances", "multiplexed inventories, late"])
def test_absurd_input_does_no_harm(name, tmp_path):
    """Leaps of kilometres, spins, and reads of tags on the moon: under gcc's sanitizers no undefined behaviour, every
    estimate finite, and still those of the kernels."""
    prepared, tags, _, _ = CASES[name].drive()
    checks = ("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all", "-O1")
    program = compiled(c_source(prepared.ready, tags, WORDS).text, tmp_path, *checks)
    recording = absurd_recording(prepared.ready.n_antennas)
    for start in (UnknownStart((0.0, 0.0, 5000.0, 4000.0)), KnownStart((2500.0, 2000.0, 1e4))):
        found = replayed(program, words_of(start), log_of(recording))
        assert np.isfinite(found).all()
        assert (found[:, [3, 5, 8]] >= 0).all()
        assert_are_the_same(found, tracked(prepared, tags, recording, start))


def absurd_recording(n_antennas: int, n_steps: int = 500) -> Recording:
    """Steps and reads without sense."""
    rng = np.random.default_rng(1)
    odometry = rng.normal(0.0, [20.0, 20.0, 0.1], (n_steps, 3))
    odometry[rng.random(n_steps) < 0.01] *= [5e5, 5e5, 1e4]
    counts = rng.choice([0, 1, 2, 5, 100], n_steps, p=[0.5, 0.3, 0.1, 0.08, 0.02])
    n_reads = int(counts.sum())
    places = rng.uniform(0.0, [5000.0, 4000.0], (n_reads, 2))
    places[rng.random(n_reads) < 0.02] *= 3.8e8
    return Recording(
        0.05, np.zeros((n_steps + 1, 3)), odometry, np.r_[0, np.cumsum(counts)],
        rng.integers(0, n_antennas, n_reads, dtype=np.int32), np.zeros(n_reads, np.int32), places,
        rng.uniform(0.0, 0.2, n_reads), rng.integers(-2, 12, n_reads, dtype=np.int32),
    )  # fmt: skip


@needs_gcc
def test_reads_of_antennas_that_there_are_not_are_left_out(tmp_path):
    prepared, tags, recording, start = Case(duration_s=5.0).drive()
    program, log = compiled(c_source(prepared.ready, tags, WORDS).text, tmp_path), log_of(recording)
    lines = []
    for line in log.splitlines():
        forward, left, turn, n_reads, *reads = line.split()
        more = ["8", "100.0", "100.0", "0.0", "-1", "-1", "100.0", "100.0", "0.0", "-1"]
        lines.append(" ".join([forward, left, turn, str(int(n_reads) + 2), *more, *reads]))
    with_more = replayed(program, words_of(start), "\n".join(lines) + "\n")
    assert np.array_equal(with_more, replayed(program, words_of(start), log))


@needs_gcc
def test_a_tag_that_was_read_is_found_on_the_map_by_its_place_to_a_tenth_of_a_millimetre(tmp_path):
    """As `tags.csv` has it: of random tags, whose places are no round numbers, inventories read several at once."""
    prepared, tags, recording, start = Case(
        YAWED, antenna("320x230"), 25.0, ReadModel(answers="all"), pattern="random"
    ).drive()
    rounded = Recording(
        recording.dt_s, recording.true_poses, recording.odometry, recording.read_start, recording.read_antenna,
        recording.read_tag, np.round(recording.read_tag_mm, 1), recording.read_age_s, recording.read_rssi,
    )  # fmt: skip
    program = compiled(c_source(prepared.ready, tags, WORDS).text, tmp_path)
    exact, found = (replayed(program, words_of(start), log_of(log)) for log in (recording, rounded))
    # What rounding moves a tag by, and not what a tag does that was read and is held to be unread.
    assert np.abs(found[:, :2] - exact[:, :2]).max() < 1.0


@needs_gcc
def test_another_file_of_c_or_c_plus_plus_includes_what_it_calls_alone(tmp_path):
    """And the memory of a state is what the comment says."""
    prepared, tags, _, _ = Case().drive()
    portable = c_source(prepared.ready, tags, WORDS)
    (tmp_path / "rfid_pmg.c").write_text(portable.text)
    caller = """
        #define PMG_API_ONLY
        #include "rfid_pmg.c"
        #include <stdio.h>
        int main(void)
        {
            static pmg_state state;
            const double odometry[3] = {0.0, 0.0, 0.0};
            pmg_estimate e;
            pmg_init_known(&state, 1000.0, 2000.0, 0.5);
            pmg_step(&state, odometry, 0, 0, &e);
            printf("%d %s", (int)sizeof state, e.x > 970.0 && e.x < 1030.0 ? "there" : "elsewhere");
            return 0;
        }
    """
    subprocess.run([GCC, *STRICT, "-c", "rfid_pmg.c", "-o", "pmg.o"], cwd=tmp_path, check=True)
    for language, compiler in (("c", GCC), ("c++", shutil.which("g++"))):
        if compiler is None:
            continue
        (tmp_path / "caller").write_text(caller)
        options = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-x", language, "caller", "-x", "none", "pmg.o", "-lm"]
        subprocess.run([compiler, *options, "-o", "program"], cwd=tmp_path, check=True)
        found = subprocess.run([tmp_path / "program"], capture_output=True, text=True, check=True).stdout
        assert found == f"{portable.state_bytes} there"


@needs_gcc
@pytest.mark.parametrize(
    ("words", "log", "told"),
    [
        ([], "", "give known X Y HEADING"),
        (["known", "1", "2"], "", "give known X Y HEADING"),
        (["known", "1", "2", "x"], "", "give known X Y HEADING"),
        (["known", "1", "2", "3"], "1 2 3\n", "a step is not forward left turn n_reads"),
        (["known", "1", "2", "3"], "1 2 3 1000000\n", "a step has too many reads"),
        (["known", "1", "2", "3"], "1 2 3 1 0 5 5 0\n", "a read is not antenna tag_x tag_y age_s rssi"),
    ],
)
def test_the_replay_program_says_what_is_wrong_with_its_input(words, log, told, tmp_path):
    prepared, tags, _, _ = Case(tags_per_m2=16.0).drive()
    program = compiled(c_source(prepared.ready, tags, WORDS).text, tmp_path)
    found = subprocess.run([program, *words], input=log, capture_output=True, text=True)
    assert found.returncode == 2
    assert told in found.stderr


def test_the_same_filter_gives_the_same_bytes():
    prepared, tags, _, _ = Case().drive()
    again, tags_again, _, _ = Case().drive()
    assert c_source(prepared.ready, tags, WORDS) == c_source(again.ready, tags_again, WORDS)


def test_no_title_ends_the_comment():
    prepared, tags, _, _ = Case(tags_per_m2=16.0).drive()
    title = "x */ int /* y ??/\n#error \u202e" + 40 * "long "
    text = c_source(prepared.ready, tags, Words("s", title, "d", (0.0, 0.0, 1.0, 1.0))).text
    comment, rest = text.split("*/", 1)
    assert "error" in comment
    assert comment.count("/*") == 1
    assert rest.startswith("\n#ifndef RFID_PMG_H")
    assert "??" not in comment
    assert "\u202e" not in comment
    assert max(map(len, text.splitlines())) <= 120


def test_a_map_too_large_for_a_file_is_refused():
    prepared, _, _, _ = Case().drive()
    tags = build_tag_map(np.random.default_rng(1).uniform(0, 1e5, (510_000, 2)))
    with pytest.raises(ValueError, match=r"the map of 510,000 tags and the field would take 8,15.* at most 8,000,000"):
        c_source(prepared.ready, tags, WORDS)


def test_a_filter_that_learns_from_reads_alone_needs_no_map():
    prepared, tags, _, _ = Case(filter_=Pmg(learns_from_nothing=False)).drive()
    for given in (tags, None):
        portable = c_source(prepared.ready, given, WORDS)
        assert (portable.n_tags, portable.table_bytes) == (0, 0)
        assert "pmg_tag_x" not in portable.text


def test_another_filter_is_refused():
    ready = registry.build(Mcl(), Robot(YAWED, antenna("60x60").area), 0.05)
    with pytest.raises(ValueError, match="the filter is Mcl, must be Pmg"):
        c_source(ready, None, WORDS)
