"""Rods in space: true sections, marks of supports and loads, by VTK; and files of them for other programs."""
