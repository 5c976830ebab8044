"""A floor as an installer left it: laid once, driven over many times, with whatever map the filter is given."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rfiddesign import require
from rfiddesign.design import Design
from rfiddesign.floor import TagMap, build_tag_map
from rfiddesign.metrics import RunMetrics
from rfiddesign.simulation.monte_carlo import Simulator
from rfiddesign.simulation.run import key_of, prepare, score, trace_run, true_poses
from rfiddesign.simulation.scenario import Scenario, World

# Which of a seed's streams: the floor and its faults.
_STREAM_LAID = 71


@dataclass(frozen=True)
class LayingFaults:
    """What goes wrong when tags are laid.

    Parameters
    ----------
    error_mm : standard deviation per axis of where a tag lies about its nominal place [mm].
    dead_share : chance of each tag to be dead.
    n_swapped_pairs : pairs of tags that are laid at each other's place, far or near, drawn among all.
    """

    error_mm: float
    dead_share: float = 0.0
    n_swapped_pairs: int = 0

    def __post_init__(self) -> None:
        require.within("error_mm", self.error_mm, low=0.0, high=1000.0)
        require.within("dead_share", self.dead_share, low=0.0, high=1.0)
        require.within("n_swapped_pairs", self.n_swapped_pairs, low=0, high=100_000)


@dataclass(frozen=True, eq=False)
class LaidFloor:
    """Where the tags of a floor lie in truth.

    Parameters
    ----------
    nominal_mm, true_mm : (n, 2) where the plan has each tag, and where it lies [mm].
    is_dead : (n,) tags that never answer.
    partner : (n,) tag that each was swapped with, -1: none.
    """

    nominal_mm: np.ndarray
    true_mm: np.ndarray
    is_dead: np.ndarray
    partner: np.ndarray

    @cached_property
    def alive(self) -> np.ndarray:
        """Ids of the tags that answer."""
        return np.flatnonzero(~self.is_dead)

    def swapped_pairs(self) -> list[tuple[int, int]]:
        """Ids of the tags that lie at each other's place."""
        return [(i, int(self.partner[i])) for i in np.flatnonzero(self.partner >= 0).tolist() if i < self.partner[i]]


@dataclass(frozen=True, eq=False)
class MapInUse:
    """A floor with a map of it, as runs take both.

    Parameters
    ----------
    truth : the tags that answer and are on the map: where they lie, and, as their nominal places, where it has them.
    known : the map.
    """

    truth: TagMap
    known: TagMap


def lay_floor(nominal_mm: np.ndarray, faults: LayingFaults, seed: int) -> LaidFloor:
    """Lay the tags of a plan (n, 2) [mm] once; the same for a seed, whatever the error is."""
    nominal = np.asarray(nominal_mm, float)
    n = len(nominal)
    if 2 * faults.n_swapped_pairs > n:
        raise ValueError(f"n_swapped_pairs is {faults.n_swapped_pairs}, at most {n // 2} pairs are among {n} tags")
    draw = np.random.default_rng([seed, _STREAM_LAID])
    errors, luck, order = draw.standard_normal((n, 2)), draw.random(n), draw.permutation(n)
    partner = np.full(n, -1)
    for i, j in order[: 2 * faults.n_swapped_pairs].reshape(-1, 2).tolist():
        partner[i], partner[j] = j, i
    place = np.where(partner >= 0, partner, np.arange(n))
    return LaidFloor(nominal, nominal[place] + faults.error_mm * errors[place], luck < faults.dead_share, partner)


def map_in_use(floor: LaidFloor, ids: np.ndarray, places_mm: np.ndarray) -> MapInUse:
    """A floor with the map that has the tags `ids` (k,) at `places_mm` (k, 2).

    A read of a tag that is not on the map tells a filter nothing, and such tags are left out of the truth.
    """
    where = np.full((len(floor.nominal_mm), 2), np.nan)
    where[ids] = places_mm
    mapped = floor.alive[np.isfinite(where[floor.alive, 0])]
    return MapInUse(build_tag_map(where[mapped], floor.true_mm[mapped]), build_tag_map(places_mm))


def laid_world(world: World) -> World:
    """A world whose floor is laid already: nothing of it is drawn anew."""
    return replace(world, installation_error_mm=0.0, dead_share=0.0)


def runs_on_floor(
    simulator: Simulator, design: Design, scenario: Scenario, in_use: MapInUse, runs: Iterable[int]
) -> list[RunMetrics]:
    """Run a design on one floor with one map; run i has the route, odometry and reads of every other run i.

    `scenario` has the filter that goes with the map; its floor is laid already, see `laid_world`.
    """
    prepared = prepare(design, replace(scenario, world=laid_world(scenario.world)))
    # Tags that lie off their lattice are not to be looked for on it.
    prepared = replace(prepared, rig=prepared.rig._replace(lattice=(0.0,) * 6))

    def one(run: int) -> RunMetrics:
        poses, key = true_poses(scenario, simulator.seed, run), key_of(simulator.seed, run)
        trace = trace_run(prepared, scenario, in_use.truth, poses, key, known_tags=in_use.known)
        return score(trace, scenario)

    return list(simulator.map(one, runs))
