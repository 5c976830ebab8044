"""The command line: `rfiddesign run | check | evaluate | coverage | ...`, see `rfiddesign --help`.

Only this module prints and exits.  Everything heavy is imported inside the commands, so that `--help` is quick.
"""

import json
import signal
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter

from rfiddesign import __version__
from rfiddesign.errors import StudyError

NOT_VERIFIED = 1
BAD_INPUT = 2
INTERRUPTED = 130
MAX_WORKERS = 1024

app = App(
    name="rfiddesign",
    help="Find the cheapest RFID installation that keeps your robots' localization error under your limits.",
    version=__version__,
)

Settings = Annotated[
    list[str] | None,
    Parameter(name="--set", consume_multiple=True, negative=(), help="KEY=VALUE, such as layout=cross-8; repeatable"),
]
Json = Annotated[bool, Parameter(name="--json", negative=(), help="print one JSON object and nothing else")]
Seed = Annotated[int | None, Parameter(help="seed in place of the study's")]
Workers = Annotated[int | None, Parameter(help="threads; default: one per core")]
VariantName = Annotated[str | None, Parameter(name="--variant", help="a variant that the study file names")]


@app.command
def run(
    study: Path, *, set_: Settings = None, out: Path | None = None, workers: Workers = None, seed: Seed = None,
    json: Json = False,
):  # fmt: skip
    """Search the cheapest certified design of STUDY and write its report; an interrupted search goes on.

    If the study file names variants, each is answered in a folder of its own, and they are compared.

    Parameters
    ----------
    study : folder of a study, or its study.toml.
    out : folder for the results; default: results/NAME.
    """
    from rfiddesign.cli.extras import extras_of
    from rfiddesign.cli.progress import StageDisplay
    from rfiddesign.cli.text import answer_lines, comparison_lines
    from rfiddesign.report import write_comparison, write_report
    from rfiddesign.study import load_study, run_study, run_variants

    _check_count("--workers", workers, MAX_WORKERS)
    loaded = load_study(study, _settings(set_, seed))
    folder, told = out or Path("results") / loaded.name, {}
    try:
        with StageDisplay() as display:
            if loaded.variants:
                result = run_variants(loaded, folder, workers, display.show, _draw_missing)
                page = write_comparison(folder)
                lines = comparison_lines(result, folder, page)
            else:
                result = run_study(loaded, folder, workers, display.show)
                display.say("drawing the report")
                page = write_report(folder)
                told, more = extras_of(folder)
                lines = answer_lines(result, folder, page, more)
    except KeyboardInterrupt:
        print(f"interrupted; what was done is in {folder}: the same command goes on from there", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None
    _tell(json, result.model_dump(mode="json") | told | {"report": str(page)}, lines)


@app.command
def check(study: Path, *, set_: Settings = None, json: Json = False):
    """Read STUDY, say what it and its variants would search and how its floor depends on the map; simulate nothing.

    Parameters
    ----------
    study : folder of a study, or its study.toml.
    """
    from rfiddesign.cli.text import check_lines
    from rfiddesign.study import check_study, load_study

    summary = check_study(load_study(study, _settings(set_, None)))
    _tell(json, summary, check_lines(summary))


@app.command
def evaluate(
    study: Path, *, set_: Settings = None, variant: VariantName = None, runs: int = 20, workers: Workers = None,
    gap: Annotated[bool, Parameter(negative=())] = False, seed: Seed = None, json: Json = False,
):  # fmt: skip
    """Simulate one design of STUDY and print its localization errors.

    Parameters
    ----------
    study : folder of a study, or its study.toml.
    runs : number of runs.
    gap : compare with the exact filter on the same runs, too: the optimality gap; slow.
    """
    from rfiddesign.cli.progress import CountDisplay
    from rfiddesign.cli.text import evaluation_lines
    from rfiddesign.evaluate import MAX_RUNS
    from rfiddesign.study import evaluate_study, load_study, variant_of

    _check_count("--workers", workers, MAX_WORKERS)
    _check_count("--runs", runs, MAX_RUNS)
    loaded = variant_of(load_study(study, _settings(set_, seed)), variant, "--variant")
    total = 2 * runs if gap else runs
    with CountDisplay(f"{total:,} runs", total) as display:
        summary = evaluate_study(loaded, runs, workers, display.show, with_gap=gap)
    _tell(json, summary, evaluation_lines(summary))


@app.command
def coverage(study: Path, *, set_: Settings = None, variant: VariantName = None, json: Json = False):
    """Print what the antennas of one design of STUDY see of its tags, and where they are blind.

    Parameters
    ----------
    study : folder of a study, or its study.toml.
    """
    from rfiddesign.cli.text import coverage_lines
    from rfiddesign.study import coverage_of_study, load_study, variant_of

    summary = coverage_of_study(variant_of(load_study(study, _settings(set_, None)), variant, "--variant"))
    _tell(json, summary, coverage_lines(summary))


@app.command
def place_readers(
    study: Path, *, set_: Settings = None, variant: VariantName = None, name: str | None = None,
    out: Path | None = None, json: Json = False,
):  # fmt: skip
    """Place readers as the [placements.NAME] of STUDY ask, and print them, their bound, and a layout to copy.

    Parameters
    ----------
    study : folder of a study, or its study.toml.
    name : one of its placements; default: all.
    out : folder for placements.json and a picture of each.
    """
    from rfiddesign.cli.placements import placement_lines
    from rfiddesign.report import draw_placements
    from rfiddesign.study import load_study, place_readers_of, save_placements, variant_of

    loaded = variant_of(load_study(study, _settings(set_, None)), variant, "--variant")
    found = place_readers_of(loaded.path, loaded.file, name)
    if out is not None:
        save_placements(loaded.path, loaded.file, tuple(found), out)
        draw_placements(out)
    _tell(json, found, placement_lines(found))


@app.command
def sparsest_pattern(
    study: Path, *, set_: Settings = None, variant: VariantName = None, distance_mm: float = 1000.0,
    speed_mm_per_s: float = 300.0, read_time_s: float = 0.05, step_mm: float = 10.0, json: Json = False,
):  # fmt: skip
    """Find the sparsest rows of tags over which the robot of STUDY's design reads in time from anywhere.

    Parameters
    ----------
    study : folder of a study, or its study.toml.
    distance_mm : driven straight on, from anywhere, before a read has come [mm].
    speed_mm_per_s : of the robot [mm/s].
    read_time_s : for which a tag must be in view to be read [s].
    step_mm : steps of pitch and row spacing [mm].
    """
    from rfiddesign.cli.placements import sparse_lines
    from rfiddesign.study import load_study, sparsest_of_study, variant_of

    loaded = variant_of(load_study(study, _settings(set_, None)), variant, "--variant")
    found = sparsest_of_study(loaded, (distance_mm, speed_mm_per_s, read_time_s), step_mm)
    _tell(json, found, sparse_lines(found))


@app.command
def export_estimator(
    study: Path, *, set_: Settings = None, variant: VariantName = None, out: Path = Path(), json: Json = False
):
    """Write the projected-moment Gaussian filter (pmg) of one design of STUDY as one C99 file for the robot.

    Its numbers and its tag map are filled in; the comment at its top says how to call it.

    Parameters
    ----------
    study : folder of a study, or its study.toml.
    out : file to write, or folder for rfid_pmg.c; default: the current one.
    """
    from rfiddesign.cli.text import export_lines
    from rfiddesign.study import export_estimator as write_estimator
    from rfiddesign.study import load_study, variant_of

    summary = write_estimator(variant_of(load_study(study, _settings(set_, None)), variant, "--variant"), out)
    _tell(json, summary, export_lines(summary))


@app.command
def report(folder: Path):
    """Draw the report of a finished study, or of the comparison of its variants, again, from its folder alone.

    Parameters
    ----------
    folder : results of `rfiddesign run`; of a comparison, or of one of its variants.
    """
    from rfiddesign.report import write_comparison, write_report
    from rfiddesign.results.folder import COMPARISON

    print(write_comparison(folder) if (folder / COMPARISON).exists() else write_report(folder))


@app.command
def verify(
    folder: Path, *, rerun: Annotated[bool, Parameter(negative=())] = False, seed: Seed = None,
    workers: Workers = None, json: Json = False,
):  # fmt: skip
    """Derive the answer in FOLDER anew from its stored runs, prices and test; exit status 1 if anything differs.

    Parameters
    ----------
    folder : results of `rfiddesign run`; of a comparison: every variant in it.
    rerun : if nothing differs simulate the chosen designs on fresh seeds, too, until the test decides.
    seed : seed of the fresh drives; default: one that follows from the study's.
    """
    from rfiddesign.cli.progress import CountDisplay
    from rfiddesign.cli.text import verification_lines
    from rfiddesign.study import rerun as run_again
    from rfiddesign.study import verify as derive

    _check_count("--workers", workers, MAX_WORKERS)
    summary = {}
    for each in _answered(folder):
        checks, again = derive(each), ()
        if rerun and not any(check.faults for check in checks):
            with CountDisplay("drives on fresh seeds", None) as display:
                again = run_again(each, seed, workers, display.show)
        summary[str(each)] = {
            "checks": [asdict(check) for check in checks],
            "reruns": [asdict(one) for one in again],
        }
    is_good = all(
        not any(check["faults"] for check in found["checks"])
        and all(one["verdict"] != "refuted" for one in found["reruns"])
        for found in summary.values()
    )
    _tell(json, {"is_verified": is_good, "folders": summary}, verification_lines(summary, is_good=is_good))
    if not is_good:
        raise SystemExit(NOT_VERIFIED)


@app.command
def reproduce(
    name: str,
    *,
    quick: Annotated[bool, Parameter(negative=())] = False,
    out: Path | None = None,
    workers: Workers = None,
    json: Json = False,
):
    """Simulate a published system again and print its numbers beside the printed ones.

    Parameters
    ----------
    name : folder of a reproduction, its study.toml, or its name in studies/.
    quick : reduced numbers of runs, for a look or for CI.
    out : folder for rows and figures; default: results/NAME.
    """
    from rfiddesign.cli.progress import StepDisplay
    from rfiddesign.cli.text import reproduction_lines
    from rfiddesign.reproduce import load_reproduction, write_reproduction
    from rfiddesign.reproduce import reproduce as simulate_again

    _check_count("--workers", workers, MAX_WORKERS)
    loaded = load_reproduction(name)
    folder = out or Path("results") / loaded.name
    with StepDisplay() as display:
        found = simulate_again(loaded, is_quick=quick, n_workers=workers, on_progress=display.show)
        display.say("writing rows and figures")
        write_reproduction(found, folder)
    _tell(json, found.as_json() | {"folder": str(folder)}, reproduction_lines(found, folder))


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; bad input ends in one line on standard error and exit status 2."""
    # SIGINT, too: a shell starts background jobs with it ignored, and whoever sends it to one means it.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)
    try:
        app(arguments, exit_on_error=False, print_error=False)
    except CycloptsError as error:
        _fail(str(error))
    except StudyError as error:
        _fail(str(error))
    except OSError as error:
        _fail(": ".join(str(part) for part in (error.filename, error.strerror or error) if part))
    except KeyboardInterrupt:
        raise SystemExit(INTERRUPTED) from None


def _answered(folder: Path) -> list[Path]:
    """The folder of a study's answer; of a comparison those of its variants."""
    from rfiddesign.results.comparison import Comparison
    from rfiddesign.results.folder import COMPARISON, read_record

    if not (folder / COMPARISON).exists():
        return [folder]
    return [folder / variant.folder for variant in read_record(folder / COMPARISON, Comparison).variants]


def _draw_missing(folder: Path) -> None:
    """Draw the report of a finished study unless it is there."""
    from rfiddesign.report import write_report
    from rfiddesign.results.folder import REPORT

    if not (folder / REPORT).exists():
        write_report(folder)


def _settings(given: list[str] | None, seed: int | None) -> tuple[str, ...]:
    return (*(given or ()), *(() if seed is None else (f"seed={seed}",)))


def _check_count(option: str, value: int | None, largest: int) -> None:
    if value is not None and not 1 <= value <= largest:
        raise StudyError(f"found {value}, must be from 1 to {largest:,}", file=option)


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _tell(is_json: bool, value: Any, lines: list[str]) -> None:
    """Print what was found, as one JSON object or in words."""
    print(json.dumps(value, indent=1, allow_nan=False) if is_json else "\n".join(lines))


def _fail(message: str) -> None:
    print("rfiddesign: " + " ".join(message.split()), file=sys.stderr)
    raise SystemExit(BAD_INPUT)
