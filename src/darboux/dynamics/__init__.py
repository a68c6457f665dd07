"""Motion: one file per method, and simulate()."""
