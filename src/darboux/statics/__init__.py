"""Equilibria: one file per method."""
