"""Compiled kernels: numbers in, numbers out. They know nothing of rods, loads or units, and import nothing of ours."""
