"""Simulated drives: routes, what wheels and readers report, and what the filter makes of it."""

from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.network_drive import NetworkDrive
from rfiddesign.simulation.scenario import Routes, Scenario, World

__all__ = ["Job", "NetworkDrive", "Routes", "Scenario", "Simulator", "World"]
