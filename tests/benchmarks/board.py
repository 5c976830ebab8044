"""What a benchmark reports: rows of the table, curves of growth, and how both are written down."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Row:
    """Our time for a piece of work against others', all from one interleaved run.

    Parameters
    ----------
    work : what was done, in words.
    unit : unit of the times, as "ns per particle-step".
    ours : our time.
    peers : time of each peer by name.
    bars : (peer, bound, is_at_least): the ratio peer / ours must be at least, or ours / peer at most, the bound.
    """

    work: str
    unit: str
    ours: float
    peers: dict[str, float]
    bars: tuple[tuple[str, float, bool], ...] = ()


@dataclass(frozen=True)
class Share:
    """Processor time [s] of a part of the main job, and its share of the whole."""

    part: str
    seconds: float
    share: float


@dataclass
class Board:
    """Everything measured in one session."""

    rows: list[Row] = field(default_factory=list)
    curves: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    shares: list[Share] = field(default_factory=list)

    def table(self) -> str:
        """The rows as a markdown table."""
        lines = ["| work | unit | ours | against | its time | ratio | bar | |", "|---|---|---|---|---|---|---|---|"]
        for row in self.rows:
            bars = {peer: (bound, is_at_least) for peer, bound, is_at_least in row.bars}
            for peer, peers_time in row.peers.items():
                bound, is_at_least = bars.get(peer, (None, True))
                ratio = peers_time / row.ours if is_at_least else row.ours / peers_time
                bar = verdict = ""
                if bound is not None:
                    bar = f"{'at least' if is_at_least else 'at most'} {bound:g}"
                    verdict = "met" if (ratio >= bound if is_at_least else ratio <= bound) else "not met"
                times = f"{row.ours:.3g} | {peer} | {peers_time:.4g} | {ratio:.3g}"
                lines.append(f"| {row.work} | {row.unit} | {times} | {bar} | {verdict} |")
        return "\n".join(lines)

    def growth(self) -> str:
        """The curves as markdown tables."""
        parts = []
        for name, points in self.curves.items():
            head = " | ".join(f"{x:,.0f}" for x, _ in points)
            cells = " | ".join(f"{y:.3g}" for _, y in points)
            parts.append(f"| {name} | {head} |\n|{'---|' * (len(points) + 1)}\n| | {cells} |")
        return "\n\n".join(parts)

    def profile(self) -> str:
        """The parts of the main job as a markdown table."""
        lines = ["| part of the main job | s | % |", "|---|---|---|"]
        return "\n".join(lines + [f"| {row.part} | {row.seconds:.2f} | {100 * row.share:.1f} |" for row in self.shares])


def race(contenders: dict[str, Callable[[], object]], n_rounds: int) -> dict[str, float]:
    """Least time [s] of each contender over `n_rounds` rounds in which all run in turn, after one run to warm up."""
    for run in contenders.values():
        run()
    best = dict.fromkeys(contenders, float("inf"))
    for _ in range(n_rounds):
        for name, run in contenders.items():
            begin = time.perf_counter()
            run()
            best[name] = min(best[name], time.perf_counter() - begin)
    return best
