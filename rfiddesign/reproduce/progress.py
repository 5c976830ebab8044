"""How a reproduction tells how far it is."""

from collections.abc import Callable

#: Called with what is under way, how much of it is done and how much there is.
OnProgress = Callable[[str, int, int], None]


def counter(what: str, n: int, on_progress: OnProgress) -> Callable[[], None]:
    """What to call once for each of `n` parts that is done."""
    done = 0

    def count() -> None:
        nonlocal done
        done += 1
        on_progress(what, done, n)

    return count
