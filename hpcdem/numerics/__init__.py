"""Arithmetic that kernels of all physics share: exact sums, random numbers, tiles of columns, fingerprints."""
