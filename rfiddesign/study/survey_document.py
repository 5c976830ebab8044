"""From the floors that were surveyed to what is saved: `survey.json` and the map `surveyed_tags.csv`."""

from pathlib import Path

import numpy as np

from rfiddesign import __version__
from rfiddesign.estimators.tag_mapping.survey import DEAD, MISPLACED, UNSEEN, SurveyedTags, mean_correction_mm
from rfiddesign.evaluate import mean_of
from rfiddesign.results import folder as files
from rfiddesign.results import survey as records
from rfiddesign.results.study_result import MeanRecord
from rfiddesign.study.design_document import rounded
from rfiddesign.study.document import cost_line_records
from rfiddesign.study.load import Study
from rfiddesign.study.survey_found import Denser, Drives, FloorFound, SurveyFound
from rfiddesign.units import money

# Distances that a record keeps, and tags about the floor's middle that it draws.
MAX_DISTANCES, MAX_SAMPLE = 2000, 25
# A difference counts as certain beyond so many of its standard errors.
CERTAIN = 2.0
CSV_HEADER = (
    "installation_error_mm,id,status,swapped_with,nominal_x_mm,nominal_y_mm,x_mm,y_mm,var_x_mm2,cov_xy_mm2,var_y_mm2,"
    "reads,true_x_mm,true_y_mm"
)


def save_survey(out: Path, study: Study, found: SurveyFound | None, digest: str) -> None:
    """Write record and map into the folder of a study that asked for a survey and has a design."""
    if found is not None:
        files.write_record(out / files.SURVEY, survey_record(study, found, digest))
        files.write_text(out / files.SURVEYED_TAGS, surveyed_csv(found))


def survey_record(study: Study, found: SurveyFound, digest: str) -> records.SurveyRecord:
    """The surveys as one record."""
    section, cost = study.file.survey, found.cost
    return records.SurveyRecord(
        version=__version__,
        study_hash=digest,
        currency=cost.currency,
        n_robots=found.answer.n_robots,
        design=found.candidate.name,
        estimator=found.candidate.estimator,
        tags_per_m2=rounded(found.candidate.design.pattern.tags_per_m2),
        passes=section.passes,
        directions=section.directions,
        lane_pitch_mm=section.lane_pitch_mm,
        speed_mm_per_s=section.speed_mm_per_s,
        pose_error_mm=section.pose_error_mm,
        heading_error_deg=section.heading_error_deg,
        correlation_s=section.correlation_s,
        n_runs=section.runs,
        least_gain=section.least_gain,
        hours=rounded(found.hours),
        driven_m=rounded(found.driven_m),
        n_lanes=found.n_lanes,
        cost_lines=cost_line_records(cost),
        cost_cents=cost.total_cents,
        floors=[_floor(study, found, floor) for floor in found.floors],
    )


def _floor(study: Study, found: SurveyFound, floor: FloorFound) -> records.SurveyedFloor:
    surveyed, laid = floor.surveyed, floor.laid
    # A partner that the survey got wrong would be a mistake, not an error of a place.
    is_placed = surveyed.is_read & (surveyed.status != MISPLACED)
    before = np.hypot(*(laid.true_mm - np.where((surveyed.partner >= 0)[:, None], laid.nominal_mm[surveyed.partner],
                                                laid.nominal_mm))[is_placed].T)  # fmt: skip
    errors = (surveyed.mean_mm - laid.true_mm)[is_placed]
    is_known = not floor.is_recorded and bool(is_placed.any())
    gains = floor.drives("checked").errors_mm - floor.drives("surveyed").errors_mm
    gain = _mean(gains.tolist())
    cheapest = next((i for i, denser in enumerate(floor.denser) if denser.reaches), None)
    advice, reasons = advise(study, found, floor)
    early = floor.early
    return records.SurveyedFloor(
        installation_error_mm=floor.installation_mm,
        is_recorded=floor.is_recorded,
        n_tags=len(surveyed.status),
        n_read=int(surveyed.is_read.sum()),
        n_unseen=int(np.count_nonzero(surveyed.status == UNSEEN)),
        reads_per_tag=rounded(float(surveyed.n_reads[surveyed.is_read].mean())) if surveyed.is_read.any() else 0.0,
        visits_per_tag=rounded(float(surveyed.n_visits[surveyed.is_read].mean())) if surveyed.is_read.any() else 0.0,
        mean_correction_mm=rounded(mean_correction_mm(surveyed)),
        sigma_mm=rounded(surveyed.sigma_mm),
        n_unknown=surveyed.n_unknown,
        laid_mm=rounded(surveyed.laid_mm),
        scatter_mm=rounded(surveyed.scatter_mm),
        is_as_declared=surveyed.is_as_declared,
        before=_errors(before) if is_known else None,
        after=_errors(np.hypot(*errors.T)) if is_known else None,
        calibration=rounded(_calibration(errors, surveyed.covariance_mm2[is_placed])) if is_known else None,
        distances_before_mm=_distances(before) if is_known else [],
        distances_after_mm=_distances(np.hypot(*errors.T)) if is_known else [],
        sample=_sample(floor),
        dead=_ids(surveyed.status == DEAD),
        swapped=surveyed.swapped_pairs(),
        misplaced=_ids(surveyed.status == MISPLACED),
        dead_counts=_dead_counts(floor, surveyed),
        swapped_counts=_swapped_counts(floor, surveyed),
        early_dead=None if early is None else _dead_counts(floor, early),
        early_swapped=None if early is None else _swapped_counts(floor, early),
        maps=[_map(study, drives) for drives in floor.maps],
        gain_mm=gain,
        denser=[_denser(denser) for denser in floor.denser],
        cheapest_denser=cheapest,
        advice=advice,
        reasons=[*reasons, checking(floor), *doubts(floor)],
    )


def advise(study: Study, found: SurveyFound, floor: FloorFound) -> tuple[records.Advice, list[str]]:
    """Whether the survey of places pays, and why, in sentences."""
    checked, surveyed = floor.drives("checked").errors_mm, floor.drives("surveyed").errors_mm
    gain, least = mean_of((checked - surveyed).tolist()), study.file.survey.least_gain
    error, price = CERTAIN * gain.stderr, money(found.cost.total_cents, found.cost.currency)
    told = (
        f"on this floor the mean localization error goes from {checked.mean():.2f} to {surveyed.mean():.2f} mm"
        f" ({gain.mean:+.2f} +- {gain.stderr:.2f} mm saved)"
    )
    if gain.mean < -error:
        return "makes it worse", [f"With the surveyed map in place of the checked one {told}."]
    if gain.mean <= error:
        return "does not pay", [f"No saving over the checked map is certain: {told}."]
    if gain.mean < least * checked.mean():
        reason = f"It saves less than {least:.0%} of the checked map's error, the least worth anything: {told}."
        return "does not pay", [reason]
    reasons = [f"It saves {gain.mean / checked.mean():.0%} of the checked map's error: {told}."]
    reasons.append(_kept(study, floor))
    denser = next((denser for denser in floor.denser if denser.reaches), None)
    if denser is None:
        if floor.denser:
            densest = floor.denser[-1]
            reasons.append(
                f"No denser floor up to {densest.design.pattern.tags_per_m2:g} tags/m2 reaches that mean error, even"
                f" with its dead and swapped tags known, which is not charged"
                f" ({densest.drives.errors_mm.mean():.2f} mm there, for"
                f" {money(densest.extra_cents, found.cost.currency)} more); the survey costs {price}."
            )
        else:
            reasons.append(f"No denser floor was looked at; the survey costs {price}.")
        return "pays", reasons
    extra = money(denser.extra_cents, found.cost.currency)
    reasons.append(
        f"A floor of {denser.design.pattern.tags_per_m2:g} tags/m2 reaches that mean error with its dead and swapped"
        f" tags known, which is not charged ({denser.drives.errors_mm.mean():.2f} mm, for {extra} more); the survey"
        f" costs {price}."
    )
    return ("pays" if found.cost.total_cents < denser.extra_cents else "does not pay"), reasons


def _kept(study: Study, floor: FloorFound) -> str:
    """How often the limits are kept with and without the survey, as a sentence."""
    shares = [
        float(np.mean([study.requirement.is_met(run) for run in floor.drives(name).runs]))
        for name in ("checked", "surveyed")
    ]
    kept = f"{shares[0]:.0%} of drives with the checked map, in {shares[1]:.0%} with the surveyed one"
    return f"On this floor the limits are kept in {kept}."


def checking(floor: FloorFound) -> str:
    """What it does to strike off dead tags and to put mixed-up ones right, as a sentence."""
    nominal, checked = floor.drives("nominal").errors_mm, floor.drives("checked").errors_mm
    gain = mean_of((nominal - checked).tolist())
    n_dead, n_misplaced = (int(np.count_nonzero(floor.surveyed.status == kind)) for kind in (DEAD, MISPLACED))
    mixed_up = f"{len(floor.surveyed.swapped_pairs())} swapped pairs"
    mixed_up += f" and {n_misplaced} misplaced tags" if n_misplaced else ""
    return (
        f"Apart from that, on this floor striking off {n_dead} dead tags and putting {mixed_up} right takes"
        f" the nominal map's error from {nominal.mean():.2f} to {checked.mean():.2f} mm ({gain.mean:+.2f} +-"
        f" {gain.stderr:.2f} mm saved)."
    )


def doubts(floor: FloorFound) -> list[str]:
    """A warning if tags do not lie as was declared, as a sentence."""
    surveyed, declared = floor.surveyed, floor.installation_mm
    if surveyed.is_as_declared:
        return []
    told = f"{surveyed.laid_mm:.1f} mm"
    if surveyed.laid_mm <= min(2.0 * surveyed.scatter_mm, declared):
        told = f"less than {min(2.0 * surveyed.scatter_mm, declared):.1f} mm"
    return [
        f"Tags seem to lie {told} per axis off the plan, not {declared:g} mm as"
        " declared: places and covariances rest on that; declare what is true."
    ]


def surveyed_csv(found: SurveyFound) -> str:
    """Every tag of every floor: where the plan, the survey and (of simulated floors) the truth have it."""
    lines = [CSV_HEADER]
    for floor in found.floors:
        surveyed = floor.surveyed
        for i, status in enumerate(surveyed.status.tolist()):
            (xx, xy), (_, yy) = surveyed.covariance_mm2[i].tolist()
            partner = "" if surveyed.partner[i] < 0 else str(surveyed.partner[i])
            places = [*surveyed.nominal_mm[i].tolist(), *surveyed.mean_mm[i].tolist()]
            numbers = [f"{value:.1f}" for value in places] + [f"{value:.2f}" for value in (xx, xy, yy)]
            true = ["", ""] if floor.is_recorded else [f"{value:.1f}" for value in floor.laid.true_mm[i].tolist()]
            row = [f"{floor.installation_mm:g}", str(i), status, partner, *numbers, str(surveyed.n_reads[i]), *true]
            lines.append(",".join(row))
    return "\n".join(lines) + "\n"


def _distances(distances: np.ndarray) -> list[float]:
    """All distances, or every k-th: ids run along the rows of a floor, so that the first would be of one side."""
    step = -(-len(distances) // MAX_DISTANCES)
    return [round(value, 2) for value in distances[:: max(step, 1)].tolist()]


def _errors(distances: np.ndarray) -> records.TagErrors:
    squared = float((distances**2).mean())
    return records.TagErrors(
        per_axis_rms_mm=rounded((squared / 2) ** 0.5),
        radial_rms_mm=rounded(squared**0.5),
        radial_mean_mm=rounded(float(distances.mean())),
    )


def _calibration(errors: np.ndarray, covariances: np.ndarray) -> float:
    return float(np.einsum("ni,nij,nj->n", errors, np.linalg.inv(covariances), errors).mean())


def _dead_counts(floor: FloorFound, surveyed: SurveyedTags) -> records.Mistakes:
    found = surveyed.status == DEAD
    if floor.is_recorded:
        return records.Mistakes(n_true=None, n_found=int(found.sum()), n_missed=None, n_false=None)
    true = floor.laid.is_dead
    return records.Mistakes(
        n_true=int(true.sum()),
        n_found=int((found & true).sum()),
        n_missed=int((true & ~found).sum()),
        n_false=int((found & ~true).sum()),
    )


def _swapped_counts(floor: FloorFound, surveyed: SurveyedTags) -> records.Mistakes:
    found = set(surveyed.swapped_pairs())
    if floor.is_recorded:
        return records.Mistakes(n_true=None, n_found=len(found), n_missed=None, n_false=None)
    true = set(floor.laid.swapped_pairs())
    return records.Mistakes(
        n_true=len(true), n_found=len(found & true), n_missed=len(true - found), n_false=len(found - true)
    )


def _sample(floor: FloorFound) -> list[records.SampleTag]:
    """The tags next to the floor's middle."""
    surveyed = floor.surveyed
    middle = (surveyed.nominal_mm.min(axis=0) + surveyed.nominal_mm.max(axis=0)) / 2
    nearest = np.argsort(np.abs(surveyed.nominal_mm - middle).max(axis=1), kind="stable")[:MAX_SAMPLE]
    found = []
    for i in np.sort(nearest).tolist():
        (xx, xy), (_, yy) = surveyed.covariance_mm2[i].tolist()
        found.append(
            records.SampleTag(
                id=i,
                status=str(surveyed.status[i]),
                nominal_mm=_point(surveyed.nominal_mm[i]),
                surveyed_mm=_point(surveyed.mean_mm[i]),
                true_mm=None if floor.is_recorded else _point(floor.laid.true_mm[i]),
                covariance_mm2=(rounded(xx), rounded(xy), rounded(yy)),
            )
        )
    return found


def _map(study: Study, drives: Drives) -> records.SurveyedMap:
    requirement = study.requirement
    return records.SurveyedMap(
        name=drives.name,
        sigma_mm=None if drives.sigma_mm is None else rounded(drives.sigma_mm),
        n_tags=drives.n_tags,
        position_mean_mm=_mean(drives.errors_mm.tolist()),
        position_p95_mm=_mean([run.position_p95_mm for run in drives.runs]),
        pass_share=_mean([float(requirement.is_met(run)) for run in drives.runs]),
    )


def _denser(denser: Denser) -> records.DenserFloor:
    return records.DenserFloor(
        tags_per_m2=rounded(denser.design.pattern.tags_per_m2),
        n_tags=denser.n_tags,
        extra_cents=denser.extra_cents,
        position_mean_mm=_mean(denser.drives.errors_mm.tolist()),
        reaches=denser.reaches,
    )


def _mean(values: list[float]) -> MeanRecord:
    mean = mean_of(values)
    return MeanRecord(mean=rounded(mean.mean), stderr=None if mean.stderr is None else rounded(mean.stderr))


def _ids(mask: np.ndarray) -> list[int]:
    return np.flatnonzero(mask).tolist()


def _point(place: np.ndarray) -> tuple[float, float]:
    x, y = place.tolist()
    return rounded(x), rounded(y)
