"""Reproductions: published systems as data, simulated again, their numbers beside the printed ones."""

from rfiddesign.reproduce.load import load_reproduction
from rfiddesign.reproduce.reproduce import Reproduced, reproduce
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.reproduce.write import write_reproduction

__all__ = ["Reproduced", "Reproduction", "load_reproduction", "reproduce", "write_reproduction"]
