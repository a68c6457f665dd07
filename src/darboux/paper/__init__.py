"""The paper's figures, recomputed: S. Tola, A. Daci, G. Zavalani, A Simulation of an Elastic Filament (2022)."""
