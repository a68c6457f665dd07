"""The paper's figures, recomputed: Tola, Daci and Zavalani, A Simulation of an Elastic Filament Using Kirchhoff Model."""
