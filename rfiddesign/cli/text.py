"""What commands print for people."""

from collections import Counter
from pathlib import Path
from typing import Any

from rfiddesign.optimize.space import ANY_LAYOUT
from rfiddesign.results.comparison import Comparison, VariantAnswer
from rfiddesign.results.study_result import AnswerRecord, StudyResult
from rfiddesign.units import DEG_PER_RAD, flops, money


def answer_lines(result: StudyResult, folder: Path, page: Path, further: tuple[str, ...] = ()) -> list[str]:
    """The cheapest design of each fleet, its price and certificate, `further` lines, and where the report is."""
    what = _candidates(is_estimator_open=result.is_estimator_open)
    were = "named by an exploration, then tested" if result.space.is_named else "tested"
    lines = [result.title, f"{result.space.n_candidates:,} {what} {were} on {result.floor.area_m2:,.0f} m2"]
    names = {design.number: design.name for design in result.designs}
    for answer in result.answers:
        lines += ["", *_answer_lines(answer, names, result)]
    return [*lines, *further, "", f"report: {page}", f"all results: {folder}"]


def _candidates(*, is_estimator_open: bool) -> str:
    return "pairs of design and estimator" if is_estimator_open else "designs"


def _answer_lines(answer: AnswerRecord, names: dict[int, str], result: StudyResult) -> list[str]:
    robots = f"{answer.n_robots:,} robot{'s' * (answer.n_robots != 1)}"
    if answer.winner is None:
        lines = [f"{robots}: no design certified: {answer.claim_words}"]
        return [*lines, f"  lower bound  {_bound_words(answer, result)}"] if answer.lower_bound else lines
    winner, test = answer.winner, result.test
    certainty = f"; none of them holds in {test.hold_probability:.0%} of drives (chance of error at most"
    certainty += f" {test.alpha_refute:.1%})"
    if answer.undecided or answer.n_untested:
        certainty = f" ({len(answer.undecided):,} undecided, {answer.n_untested:,} untested)"
    lines = [
        f"{robots}: {names[winner.design]}",
        f"  price        {money(winner.cost_cents, answer.currency)}",
        f"  certificate  {winner.n_passed:,} of {winner.n_runs:,} drives kept the limits: in more than "
        f"{test.fail_probability:.0%} of drives they hold (chance of error at most {test.alpha_certify:.1%})",
        f"  claim        {answer.claim}: {answer.claim_words}{certainty}",
    ]
    if answer.lower_bound is not None and answer.lower_bound.design != winner.design:
        lines.append(f"  lower bound  {_bound_words(answer, result)}; gap {answer.gap:.1%}")
    if answer.assumed:
        lines.append(f"  assumed      {len(answer.assumed):,} designs are ruled out by assumption alone")
    if answer.computing is not None:
        what = {each.name: each.words for each in result.estimators}.get(answer.computing.estimator, "")
        name = f"{answer.computing.estimator} ({what})" if what else answer.computing.estimator
        lines.append(f"  estimator    {name}, {flops(answer.computing.flops_per_step)} per step")
    for design in answer.runners_up:
        lines.append(f"  next best    {names[design.design]}, {money(design.cost_cents, answer.currency)}")
    return lines


def _bound_words(answer: AnswerRecord, result: StudyResult) -> str:
    """What no design that holds costs less than, and how sure that is."""
    bound, test = money(answer.lower_bound.cost_cents, answer.currency), result.test
    return (
        f"{bound}: nothing cheaper holds in {test.hold_probability:.0%} of drives (chance of error at most"
        f" {test.alpha_refute:.1%})"
    )


def comparison_lines(comparison: Comparison, folder: Path, page: Path) -> list[str]:
    """Price, saving and design of every variant for each fleet, and where the page is."""
    lines = [comparison.title, f"{len(comparison.variants)} variants; savings are against {comparison.base}"]
    width = max(len(variant.name) for variant in comparison.variants)
    for n_robots in comparison.fleets:
        lines += ["", f"{n_robots:,} robot{'s' * (n_robots != 1)}"]
        for variant in comparison.variants:
            answer = variant.answer(n_robots)
            if answer is not None:
                lines.append(f"  {variant.name:<{width}}  {_variant_words(answer)}")
    return [*lines, "", f"report: {page}", f"all results: {folder}"]


def _variant_words(answer: VariantAnswer) -> str:
    if answer.winner is None:
        return f"none certified: {answer.claim_words}"
    words = f"{money(answer.winner.cost_cents, answer.currency)}, {answer.winner.name}"
    if answer.n_undecided:
        words += f" ({answer.n_undecided} cheaper undecided)"
    if answer.saving is None:
        return words
    cents, share = answer.saving.cents, f"{abs(answer.saving.share):.1%}"
    if cents == 0:
        return f"{words}; costs the same"
    amount = money(abs(cents), answer.currency)
    return f"{words}; {f'saves {amount}' if cents > 0 else f'costs {amount} more'} ({share})"


# Faults of one kind that are told before the rest is only counted.
MOST_TOLD = 5


def verification_lines(summary: dict[str, Any], *, is_good: bool) -> list[str]:
    """What `verify` looked at, with what was wrong, folder by folder."""
    lines = []
    for folder, found in summary.items():
        lines.append(folder)
        for check in found["checks"]:
            faults = check["faults"]
            lines.append(f"  {'FAILED' if faults else 'ok    '}  {check['what']} ({check['n_looked_at']:,} looked at)")
            lines += [f"            {fault}" for fault in faults[:MOST_TOLD]]
            if len(faults) > MOST_TOLD:
                lines.append(f"            and {len(faults) - MOST_TOLD:,} more")
        for again in found["reruns"]:
            low, high = again["interval"]
            word = "FAILED" if again["verdict"] == "refuted" else "ok    "
            lines.append(
                f"  {word}  fresh seeds, {again['n_robots']:,} robots,"
                f" {again['name']}: {again['verdict']}, {again['n_passed']:,} of {again['n_runs']:,} drives passed"
                f" ({low:.1%} to {high:.1%})"
            )
    return [*lines, "verified" if is_good else "NOT verified"]


def check_lines(summary: dict[str, Any]) -> list[str]:
    """Summary of `check`."""
    floor, space = summary["floor"], summary["space"]
    n_listed = space["n_combinations"]
    what = _candidates(is_estimator_open=len(summary["estimators"]) > 1)
    lines = [
        summary["title"],
        f"floor   {floor['area_m2']:,.1f} m2 drivable, {floor['navigable_m2']:,.1f} m2 for the robot's centre"
        f" ({floor['source']})",
    ]
    for row in floor["sensitivity"]:
        if row["value"] is not None:
            lines.append(f"          {row['name']} = {row['value']:g}: {row['area_m2']:,.1f} m2")
    lines += [
        *([f"space   {n_listed:,} {what}, {space['n_unbuildable']:,} cannot be built"] if n_listed else []),
        *_unbuildable_lines(space["unbuildable"]),
        *_explored_lines(summary["explore"]),
        f"fleet   {', '.join(str(n) for n in summary['fleet'])} robots",
        *([f"filter  left open: {' or '.join(summary['estimators'])}"] if len(summary["estimators"]) > 1 else []),
    ]
    for variant in summary["variants"]:
        settings = ", ".join(f"{key} = {value}" for key, value in variant["set"].items())
        lines.append(f"variant {variant['name']}: {settings or 'as the study itself'}")
    return lines


def _explored_lines(explore: dict[str, Any] | None) -> list[str]:
    """What an exploration may try and will name."""
    if explore is None:
        return []
    return [
        f"explore {explore['n_designs']:,} designs by {explore['n_trials']:,} trials ({explore['sampler']}), then name"
        f" at most {explore['n_candidates']:,} candidates for each fleet"
    ]


def _unbuildable_lines(faults: list[dict[str, str]]) -> list[str]:
    """One line for each pair of layout and antenna, and one for each antenna that sees too much of some patterns."""
    counts = Counter((fault["layout"], fault["antenna"]) for fault in faults)
    lines = {}
    for fault in faults:
        pair, reason = (fault["layout"], fault["antenna"]), fault["reason"].split(";")[0]
        if fault["layout"] == ANY_LAYOUT:
            number = counts[pair]
            dense = "1 pattern is" if number == 1 else f"{number} patterns are"
            lines[pair] = f"          {fault['antenna']} with any layout: {reason}; {dense} too dense for that"
        else:
            lines[pair] = f"          {fault['layout']} with {fault['antenna']}: {reason}"
    return list(lines.values())


def evaluation_lines(summary: dict[str, Any]) -> list[str]:
    """Table of `evaluate`."""
    lines = [
        f"{summary['design']}: {summary['runs']:,} runs from {'an' if summary['start'] == 'unknown' else 'a'} "
        f"{summary['start']} start, {_filter_words(summary)}, {summary['wall_s']:.1f} s"
    ]
    for name, value in summary["metrics"].items():
        mean, stderr, unit = value["mean"], value["stderr"], ""
        if name.endswith("_rad"):
            mean, stderr, unit = mean * DEG_PER_RAD, stderr and stderr * DEG_PER_RAD, " (deg)"
        spread = "" if stderr is None else f" +- {stderr:.3g}"
        lines.append(f"  {name.replace('_rad', '') + unit:24} {mean:10.4g}{spread}")
    if "optimality_gap" in summary:
        found = summary["optimality_gap"]
        exact, ratio = found["reference_position_mean_mm"], found["ratio"]
        spread = "" if ratio["stderr"] is None else f" +- {ratio['stderr']:.2g}"
        lines.append(
            f"  optimality gap: {ratio['mean']:.3g}{spread} times the {exact['mean']:.3g} mm of the exact filter"
        )
    lines.append(
        f"  computing time: {summary['us_per_step']:.3g} us per step on this machine,"
        f" {flops(summary['flops_per_step'])}"
    )
    for n_robots, price in summary["price_cents_by_robots"].items():
        lines.append(f"  price for {n_robots} robots: {money(price, summary['currency'])}")
    return lines


def _filter_words(summary: dict[str, Any]) -> str:
    particles = f" of {summary['n_particles']} particles" if summary["n_particles"] else ""
    return summary["estimator"].replace("_", " ") + particles


def coverage_lines(summary: dict[str, Any]) -> list[str]:
    """Table of `coverage`."""
    lines = [f"{summary['design']} ({summary['method']})"]
    for k, share in enumerate(summary["k_coverage"], start=1):
        lines.append(f"  at least {k} read{'s' * (k > 1)}       {share:8.2%} of poses")
    lines += [
        f"  expected reads        {summary['expected_reads']:8.3f} per poll of all readers",
        f"  two tags in one view  {summary['two_tags_share']:8.2%} of poses",
        "  distance to the next read, straight on:",
    ]
    for drive in summary["blind_distances"]:
        aligned = ", along rows of tags" if drive["is_aligned"] else ""
        lines.append(
            f"    heading {drive['heading_deg']:6.2f} deg: mean {drive['mean_mm']:6.0f} mm, 95 % within "
            f"{drive['p95_mm']:6.0f} mm, at most {drive['max_mm']:6.0f} mm, "
            f"beyond 500 mm {drive['share_over_limit']:6.1%}{aligned}"
        )
    return [*lines, *(f"  warning: {warning}" for warning in summary["warnings"])]


def export_lines(summary: dict[str, Any]) -> list[str]:
    """What `export-estimator` wrote."""
    tags = f"{summary['n_tags']:,} tags" if summary["n_tags"] else "no map"
    return [
        f"{summary['design']}: {summary['estimator']} with {summary['n_antennas']} antennas and {tags}",
        f"  constant tables {summary['table_bytes']:,} bytes, state {summary['state_bytes']:,} bytes",
        f"written: {summary['file']}",
    ]


def reproduction_lines(found: Any, folder: Any) -> list[str]:
    """Tables of `reproduce`: what was published beside what was measured, and the claims."""
    lines = [found.title]
    table = None
    width = max(len(f"{row.row}, {row.metric}") for row in found.rows)
    for row in found.rows:
        if row.table != table:
            table = row.table
            lines += ["", f"{table:<{width + 2}} {'published':>10} {'measured':>10} {'+-':>9}  unit"]
        published = "" if row.published is None else f"{row.published:.4g}"
        stderr = "" if row.stderr is None else f"{row.stderr:.2g}"
        name, unit = f"{row.row}, {row.metric}", "" if row.unit == "1" else row.unit
        lines.append(f"  {name:<{width}} {published:>10} {row.measured:>10.4g} {stderr:>9}  {unit}".rstrip())
    if found.claims:
        lines += ["", "claims"]
    for claim in found.claims:
        bounds = [f"at least {claim.claim.at_least:g}"] if claim.claim.at_least is not None else []
        bounds += [f"at most {claim.claim.at_most:g}"] if claim.claim.at_most is not None else []
        measured = "not measured" if claim.measured is None else f"{claim.measured:.4g}"
        where = f"{claim.claim.table}, {claim.claim.row}, {claim.claim.metric}"
        lines.append(f"  {'holds' if claim.holds else 'FAILS'}  {where}: {measured}, {' and '.join(bounds)}")
    if found.is_quick:
        lines += ["", "--quick: few runs; claims are made of the full counts"]
    return [*lines, "", f"rows and figures: {folder}"]
