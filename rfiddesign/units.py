"""Factors between the program's own units (mm, rad, s) and those that people read."""

import math

MM_PER_M = 1e3
MM2_PER_M2 = 1e6
DEG_PER_RAD = 180.0 / math.pi
CENTS_PER_UNIT = 100
