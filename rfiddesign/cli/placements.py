"""Placed readers, and the sparsest tags for given readers, as lines of text."""

from typing import Any


def placement_lines(found: dict[str, Any]) -> list[str]:
    """Each placement with its bound, its recheck, what usual shapes need, and its layout for a study file."""
    lines: list[str] = []
    for name, one in found.items():
        lines += ["", f"{name}: {len(one['antennas'])} readers, {one['antenna']} mm antennas", *_quality(one)]
        for rival in one["rivals"]:
            lines.append(f"  {rival['shape']}: {'does the same' if rival['is_guaranteed'] else 'no'}")
        lines += ["", one["toml"]]
    return lines[1:]


def _quality(one: dict[str, Any]) -> list[str]:
    if one["is_number_given"]:
        what = "number of readers given"
    else:
        what = "fewest, proved" if one["is_proved"] else f"not proved to be fewest, gap {one['gap']:.0%}"
    lines = [f"  {what}: at least {one['lower_bound']} ({one['bound_by']}); found by {one['method']}"]
    for check in one["checks"]:
        what = f"longest {check['worst']:.0f} {check['unit']} found"
        if check["is_guaranteed"]:
            lines.append(f"  {check['motion']}: guaranteed from every phase and heading, {what}")
        else:
            lines.append(
                f"  {check['motion']}: not guaranteed, {check['sampled_unserved_share']:.2%} of sampled poses without;"
                f" surely without {check['unserved_share']:.2%}, undecided {check['undecided_share']:.2%}; {what}"
            )
    return lines


def sparse_lines(found: dict[str, Any]) -> list[str]:
    """The sparsest rows of each kind as a table."""
    lines = [
        f"{found['layout']}, {found['antenna']} mm antennas: a read of {found['read_time_s']:g} s within"
        f" {found['distance_mm']:g} mm at {found['speed_mm_per_s']:g} mm/s, forward, from every phase and heading",
        f"{'rows':12}{'pitch':>10}{'spacing':>10}{'stagger':>10}{'tags/m2':>10}{'tried':>8}",
    ]
    for one in found["patterns"]:
        if one["is_found"]:
            numbers = "".join(
                f"{one[key]:10.4g}" for key in ("pitch_mm", "row_spacing_mm", "stagger_mm", "tags_per_m2")
            )
        else:
            numbers = f"{'none does it':>40}"
        lines.append(f"{one['family']:12}{numbers}{one['n_tried']:8d}")
    return lines
