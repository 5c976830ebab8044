"""The command line."""

from rfiddesign.cli.main import main

__all__ = ["main"]
