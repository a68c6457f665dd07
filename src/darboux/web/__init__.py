"""A page on which a rod answers to the mouse: `darboux serve` (extra `[web]`)."""
