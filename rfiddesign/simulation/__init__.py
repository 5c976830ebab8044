"""Simulated drives: routes, what wheels and readers report, and what the filter makes of it."""

from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.scenario import Routes, Scenario, World

__all__ = ["Job", "Routes", "Scenario", "Simulator", "World"]
