"""Arithmetic with the same bits on every machine: SIMD lanes, elementary functions, random numbers."""
