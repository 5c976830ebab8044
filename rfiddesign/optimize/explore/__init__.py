"""Explore spaces too large to list, and name the candidates that a certification then tests."""

from rfiddesign.optimize.explore.early_stop import Standing, is_beaten
from rfiddesign.optimize.explore.explorer import (
    FIRST_RUN,
    Bench,
    ExplorePlan,
    Trial,
    check_exploration,
    explore,
)
from rfiddesign.optimize.explore.front import FIRST_FRONT_RUN, Front, Member, choose, measure_front
from rfiddesign.optimize.explore.importance import (
    EVALUATORS,
    Importance,
    Interaction,
    check_evaluator,
    importance,
    interactions,
)
from rfiddesign.optimize.explore.naming import Named, NamingPlan, apparent_optimum, name_candidates
from rfiddesign.optimize.explore.proposal import Fixed, Proposal, fault_of, propose
from rfiddesign.optimize.explore.samplers import SAMPLERS
from rfiddesign.optimize.explore.score import WORST_MARGIN, Objectives, margins, score
from rfiddesign.optimize.explore.variables import KIND_VARIABLES, Choice, Range, Value, Variable, Variables

__all__ = [
    "EVALUATORS",
    "FIRST_FRONT_RUN",
    "FIRST_RUN",
    "KIND_VARIABLES",
    "SAMPLERS",
    "WORST_MARGIN",
    "Bench",
    "Choice",
    "ExplorePlan",
    "Fixed",
    "Front",
    "Importance",
    "Interaction",
    "Member",
    "Named",
    "NamingPlan",
    "Objectives",
    "Proposal",
    "Range",
    "Standing",
    "Trial",
    "Value",
    "Variable",
    "Variables",
    "apparent_optimum",
    "check_evaluator",
    "check_exploration",
    "choose",
    "explore",
    "fault_of",
    "importance",
    "interactions",
    "is_beaten",
    "margins",
    "measure_front",
    "name_candidates",
    "propose",
    "score",
]
