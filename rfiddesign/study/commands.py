"""What the command line asks of a study beside running it, as plain data that prints as JSON."""

import math
from collections.abc import Callable, Iterable
from typing import Any

from rfiddesign.cost import Site
from rfiddesign.design import Design, check_design, check_tag_spacing
from rfiddesign.errors import StudyError
from rfiddesign.evaluate import Gap, computing_time, evaluate
from rfiddesign.floor import Floor
from rfiddesign.optimize import Space, Unbuildable, unbuildable
from rfiddesign.optimize.explore import Variables
from rfiddesign.study.design_document import antenna_poses, blind_records, coverage_record
from rfiddesign.study.estimators import reference_of
from rfiddesign.study.exploring import check_explore
from rfiddesign.study.load import Study, check_tag_count, design_of, floor_of, scenario_of, space_of
from rfiddesign.study.pipeline import price_design
from rfiddesign.study.run_study import sensitivity
from rfiddesign.study.variants import Variant, in_variant


def check_study(study: Study) -> dict[str, Any]:
    """What a study would search, its floor, how the floor depends on the map's thresholds, and its variants."""
    floor = floor_of(study)
    space, misfits = check_search(study, floor)
    variables = None if study.file.explore is None else check_explore(study, floor)
    check_variants(study.variants)
    n_unbuildable, n_combinations = sum(len(misfit.numbers) for misfit in misfits), 0 if space is None else space.size
    return {
        "study": study.name,
        "title": study.file.title,
        "floor": {
            "name": floor.name,
            "source": floor.source,
            "area_m2": round(floor.area_m2, 2),
            "navigable_m2": round(floor.navigable_m2, 2),
            "sensitivity": [
                {"name": row.name, "value": row.value, "area_m2": row.area_m2, "navigable_m2": row.navigable_m2}
                for row in sensitivity(study)
            ],
        },
        "space": {
            "n_combinations": n_combinations,
            "n_unbuildable": n_unbuildable,
            "n_buildable": n_combinations - n_unbuildable,
            "unbuildable": [
                {"layout": pair.layout_name, "antenna": pair.antenna_name, "reason": pair.reason} for pair in misfits
            ],
        },
        "explore": None if variables is None else explored_summary(study, variables),
        "requirement": dict(study.requirement.limits) | {"converged_within_s": study.requirement.converged_within_s},
        "fleet": study.file.fleet.robots,
        "estimators": list(study.file.estimator_names),
        "variants": [variant.listed() for variant in study.variants],
    }


def explored_summary(study: Study, variables: Variables) -> dict[str, Any]:
    """What a study's exploration may try and will name."""
    explore = study.file.explore
    return {
        "n_designs": variables.n_designs,
        "n_trials": explore.n_trials,
        "n_candidates": explore.n_candidates,
        "sampler": explore.sampler,
    }


def check_search(study: Study, floor: Floor) -> tuple[Space | None, tuple[Unbuildable, ...]]:
    """The listed space of a study, None without one, and what of it cannot be built.

    Raises
    ------
    StudyError : if nothing can be built, or the floor would take too many tags or no route.
    """
    if study.file.space is None:
        scenario_of(study, floor)
        return None, ()
    space = space_of(study, floor)
    for pattern in space.patterns:
        check_tag_count(study, pattern, floor, "space.tags_per_m2")
    misfits = unbuildable(space, study.footprint)
    if sum(len(misfit.numbers) for misfit in misfits) == space.size:
        raise StudyError(f"no design can be built: {misfits[0].reason}", file=study.path, key="space")
    scenario_of(study, floor)
    return space, misfits


def check_variants(variants: Iterable[Variant]) -> None:
    """Check the search of each variant, so that a fault in the last one is found before the first is simulated."""
    for variant in variants:
        with in_variant(variant.name):
            floor = floor_of(variant.study)
            check_search(variant.study, floor)
            if variant.study.file.explore is not None:
                check_explore(variant.study, floor)


def evaluate_study(
    study: Study, n_runs: int, n_workers: int | None, on_run: Callable[[int], None], *, with_gap: bool = False
) -> dict[str, Any]:
    """Errors of the study's design at hand over `n_runs` runs, and what it costs.

    `with_gap` : how far the filter is from the exact one, too; `on_run` then counts the runs of both.
    """
    design = buildable_design(study)
    floor = floor_of(study)
    check_tag_count(study, design.pattern, floor, "design.tags_per_m2")
    scenario = scenario_of(study, floor)
    n_tags = len(design.pattern.lay(floor.drivable))
    prices = {
        str(n): price_design(study, design, n_tags, Site(n, floor.area_m2)).total_cents for n in study.file.fleet.robots
    }
    reference = reference_of(study.file, study.file.world, study.file.scenario.fastest_mm_per_s)
    evaluation = evaluate(
        design, scenario, n_runs, seed=study.file.seed, requirement=study.requirement, n_workers=n_workers,
        on_run=on_run, compare_to_exact=with_gap, reference=reference,
    )  # fmt: skip
    computing = computing_time(design, scenario, seed=study.file.seed)
    return _gap(evaluation.gap) | {
        "design": design.name,
        "estimator": study.file.estimator_names[0],
        "start": scenario.start,
        "seed": study.file.seed,
        "metrics": {name: {"mean": mean.mean, "stderr": mean.stderr} for name, mean in evaluation.metrics().items()},
        "runs": n_runs,
        "steps": evaluation.n_steps,
        "n_particles": evaluation.n_particles,
        "us_per_step": computing.us_per_step,
        "flops_per_step": computing.flops_per_step,
        "n_tags": n_tags,
        "price_cents_by_robots": prices,
        "currency": study.prices.currency,
        "wall_s": evaluation.wall_s,
    }


def _gap(found: Gap | None) -> dict[str, Any]:
    if found is None:
        return {}
    return {
        "optimality_gap": {
            "reference_position_mean_mm": {"mean": found.reference_mm.mean, "stderr": found.reference_mm.stderr},
            "ratio": {"mean": found.ratio.mean, "stderr": found.ratio.stderr},
        }
    }


def coverage_of_study(study: Study) -> dict[str, Any]:
    """What the antennas of the study's design at hand see of its tags."""
    design = buildable_design(study)
    aliased, corridors = blind_records(design)
    record = coverage_record(design, (*aliased, *corridors))
    return {
        "design": design.name,
        "antennas_mm": [[pose.x_mm, pose.y_mm, pose.yaw_rad] for pose in antenna_poses(design)],
        "antenna_area_mm2": design.antenna.area.area_mm2,
        "tags_per_m2": design.pattern.tags_per_m2,
        "k_coverage": record.k_coverage,
        "expected_reads": record.expected_reads,
        "two_tags_share": record.two_tags_share,
        "method": record.method,
        "stderr": record.stderr,
        "blind_distance_mm": {f"{drive.heading_deg:g}": drive.max_mm for drive in record.drives},
        "blind_distances": [drive.model_dump(mode="json") for drive in record.drives],
        "aliased_headings_deg": [found.heading_deg for found in aliased],
        "aliasing": [_blind(found) for found in aliased],
        "blind_corridors": [_blind(found) for found in corridors],
        "warnings": record.warnings,
    }


def _blind(found: Any) -> dict[str, Any]:
    distance = found.blind_distance_mm
    return {
        "heading_deg": found.heading_deg,
        "row_spacing_mm": found.row_spacing_mm,
        "blind_share": found.blind_share,
        "blind_distance_mm": distance if math.isfinite(distance) else None,
        "message": found.message,
    }


def buildable_design(study: Study) -> Design:
    """The study's design at hand; StudyError if it cannot be built."""
    design = design_of(study)
    try:
        check_design(design, study.footprint)
        check_tag_spacing(design)
    except ValueError as error:
        raise StudyError(str(error), file=study.path, key="design") from None
    return design
