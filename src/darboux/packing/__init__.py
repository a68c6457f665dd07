"""One place where descriptions become numbers: above the problem, below every method."""
