"""Why fleets of different sizes get different designs, in sentences."""

from decimal import Decimal

from rfiddesign.report.contents import Answer, Contents
from rfiddesign.report.words import count, joined
from rfiddesign.units import money


def fleet_sentences(contents: Contents) -> tuple[str, ...]:
    """What a reader and a tag cost each fleet, and what that does to the design; nothing from a single winner."""
    won = [answer for answer in contents.answers if answer.record.winner is not None]
    if len(won) < 2:
        return ()
    few, many = (pick(won, key=lambda answer: answer.record.n_robots) for pick in (min, max))
    return (
        "Readers are paid once per robot, tags once per floor.",
        *(_exchange_rate(contents, answer) for answer in (few, many)),
        _difference(contents, few, many),
    )


def reader_cents(contents: Contents, answer: Answer) -> int:
    """Price of one reader with its antenna and cabling on every robot of the fleet [cents]."""
    n_antennas = answer.record.n_robots * contents.design(answer.record.winner).n_readers
    return sum(
        int(Decimal(line.unit_price) * 100 * answer.record.n_robots)
        for line in answer.record.cost_lines
        if line.group == "per robot" and Decimal(line.quantity) == n_antennas and "controller" not in line.item
    )


def tag_density_cents(contents: Contents, answer: Answer) -> int:
    """Price of one more tag on every m2 of what is tagged: the whole floor, or the strip along routes [cents]."""
    prices = [Decimal(line.unit_price) for line in answer.record.cost_lines if line.group == "per tag"]
    tagged = [Decimal(line.quantity) for line in answer.record.cost_lines if line.group == "per m2"]
    area_m2 = tagged[0] if contents.routes is not None else Decimal(str(contents.result.floor.area_m2))
    return int(sum(prices, Decimal(0)) * 100 * area_m2)


def _exchange_rate(contents: Contents, answer: Answer) -> str:
    record = answer.record
    reader, density = reader_cents(contents, answer), tag_density_cents(contents, answer)
    words = (
        f"For {count(record.n_robots, 'robot')} one more reader on each costs {money(reader, record.currency)}, one"
        f" more tag on every m² that is tagged {money(density, record.currency)}"
    )
    if reader <= 0 or density <= 0:
        return f"{words}."
    rate = reader / density
    worth = f"{rate:.0f}" if rate >= 10 else f"{rate:.2g}"
    return f"{words}: a reader on each robot costs as much as {worth} tags on each m²."


def _difference(contents: Contents, few: Answer, many: Answer) -> str:
    a, b = contents.design(few.record.winner), contents.design(many.record.winner)
    if a.number == b.number:
        return "Both fleets get the same design."
    changes = []
    if a.n_readers != b.n_readers:
        changes.append(f"{count(b.n_readers, 'reader')} each instead of {a.n_readers:,}")
    if a.layout != b.layout and not changes:
        changes.append(f"the layout {b.layout} instead of {a.layout}")
    if a.antenna != b.antenna:
        changes.append(f"{b.antenna} mm antennas instead of {a.antenna} mm")
    if a.pattern != b.pattern:
        changes.append(f"a {b.pattern} pattern instead of a {a.pattern} one")
    if contents.result.is_estimator_open and a.estimator != b.estimator:
        changes.append(f"the estimator {b.estimator} instead of {a.estimator}")
    if a.tags_per_m2 != b.tags_per_m2:
        changes.append(f"{b.tags_per_m2:g} tags per m² instead of {a.tags_per_m2:g}")
    return f"So {count(many.record.n_robots, 'robot')} get {joined(changes)} for {count(few.record.n_robots, 'robot')}."
