"""`python -m rfiddesign` is the command line."""

from rfiddesign.cli import main

main()
