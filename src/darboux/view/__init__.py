"""How things are drawn: one style for every figure, an orthographic camera, and rods in space."""
