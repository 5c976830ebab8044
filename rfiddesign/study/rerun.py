"""Try the chosen designs of a finished study on fresh seeds, with the test that certified them."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.errors import StudyError
from rfiddesign.floor import Floor
from rfiddesign.geometry import ListedPattern, listed
from rfiddesign.optimize import Verdict, battery, judge
from rfiddesign.results import folder as files
from rfiddesign.results.certificate import Certificate
from rfiddesign.results.exploration import Exploration
from rfiddesign.results.study_result import ChosenDesign, StudyResult
from rfiddesign.simulation.monte_carlo import Simulator
from rfiddesign.study.candidates import Candidate
from rfiddesign.study.estimators import estimators_of
from rfiddesign.study.exploration import named_candidates
from rfiddesign.study.load import Study, floor_of, reader_of, scenarios_of, study_of
from rfiddesign.study.pipeline import loosest, study_hash, test_plan

# Added to the study's seed unless another is given: far from those that people try one after the other.
FRESH_SEED = 0x5EED_F4E5_0000_0001
MAX_SEED = 2**63 - 1
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Rerun:
    """A chosen design on fresh seeds.

    Parameters
    ----------
    n_robots : the fleet that it was chosen for.
    name : the design.
    verdict, n_runs, n_passed : what the test says of its fresh drives, at the whole of `alpha_certify`.
    interval : 95 % confidence limits of the share of drives that pass (Clopper and Pearson); the test may stop at a run
        that suits it, so that they describe and do not certify.
    """

    n_robots: int
    name: str
    verdict: Verdict
    n_runs: int
    n_passed: int
    interval: tuple[float, float]


def rerun(
    folder: Path, seed: int | None, n_workers: int | None, on_run: Callable[[int], None] = lambda n: None
) -> tuple[Rerun, ...]:
    """Simulate the chosen design of each fleet on fresh seeds until the test decides or its cap of runs is reached.

    Parameters
    ----------
    folder : results of a study, whose study file, prices and map must still be where they were.
    seed : seed of the fresh drives; None: one that follows from the study's.
    n_workers : threads; None: one per core.
    on_run : called with the number of drives made so far.

    Raises
    ------
    StudyError : if the folder or the study's files are missing or have changed.
    """
    digest = files.read_record(folder / files.CERTIFICATE, Certificate).study_hash
    result = files.read_record(folder / files.RESULT, StudyResult)
    study = _study_again(folder, digest)
    fresh = (study.file.seed + FRESH_SEED) % (MAX_SEED + 1) if seed is None else seed
    if fresh == study.file.seed:
        raise StudyError(f"found {seed}, which is the seed of the study itself", file="--seed")
    plan, found, n_done = test_plan(study, 1), [], 0
    tests = battery(plan)
    floor = floor_of(study)
    scenarios = scenarios_of(study, floor)
    with Simulator(scenarios[0], fresh, n_workers, loosest(study)) as simulator:
        explored = _explored(folder, study, floor, simulator)
        for i, answer in enumerate(result.answers):
            if answer.winner is None:
                continue
            place = files.answer_folder(folder, answer.n_robots, is_first=i == 0)
            candidate = explored.get(answer.winner.design) or _candidate(study, place, scenarios)
            verdict, n_runs = "undecided", 0
            rows: list[list] = [[] for _ in scenarios]
            while verdict == "undecided" and n_runs < plan.max_runs:
                ahead = range(n_runs, min(plan.max_runs, max(2 * n_runs, 32)))
                for s, row in enumerate(rows):
                    row.extend(simulator.runs(candidate.job(run, s) for run in ahead))
                decision = judge(tests, study.criteria.scores(rows))
                verdict, n_runs = decision.verdict, len(rows[0])
                on_run(n_done + n_runs)
            n_done += n_runs
            interval = _interval(decision.n_passed, decision.n_runs)
            found.append(Rerun(answer.n_robots, candidate.name, verdict, decision.n_runs, decision.n_passed, interval))
    return tuple(found)


def _study_again(folder: Path, digest: str) -> Study:
    """The study that a folder answers, from its own record and the files that it names."""
    try:
        resolved = json.loads((folder / files.STUDY).read_bytes())["study"]
        path = Path(json.loads((folder / files.PROVENANCE).read_bytes())["study_file"])
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=error.filename) from None
    except (ValueError, LookupError, TypeError):
        raise StudyError("does not say where its study is", file=folder / files.PROVENANCE) from None
    study = study_of(path, resolved)
    if study_hash(study) != digest:
        raise StudyError(f"its files, the map, the catalog or the program changed since {folder}", file=path)
    return study


def _explored(folder: Path, study: Study, floor: Floor, simulator: Simulator) -> dict[int, Candidate]:
    """The candidates that an exploration named, which may have particles and speeds of their own; none without one."""
    if study.file.explore is None:
        return {}
    record = files.read_record(folder / files.EXPLORATION, Exploration)
    return named_candidates(study, floor, simulator, record)


def _candidate(study: Study, place: Path, scenarios: tuple) -> Candidate:
    """The chosen design as it was written for the workshop: its antennas and tags where the files have them."""
    chosen = files.read_record(place / files.DESIGN, ChosenDesign)
    tags = np.loadtxt(place / files.TAGS, delimiter=",", skiprows=1, usecols=(1, 2), ndmin=2)
    layout = listed([(pose.x_mm, pose.y_mm, pose.yaw_rad) for pose in chosen.antennas])
    design = Design(layout, antenna(chosen.antenna), ListedPattern(tags), reader_of(study))
    settings = estimators_of(study.file, study.file.world, study.file.scenario.fastest_mm_per_s)
    name = chosen.estimator or study.file.estimator_names[0]
    return Candidate(chosen.name, design, name, settings[name], chosen.n_tags, 0.0, scenarios)


def _interval(n_passed: int, n_runs: int) -> tuple[float, float]:
    """Clopper and Pearson's limits of a share."""
    limits = binomtest(n_passed, n_runs).proportion_ci(CONFIDENCE, method="exact")
    return float(limits.low), float(limits.high)
