"""Placed readers as lines of text."""

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
