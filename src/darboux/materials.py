"""Materials by name: typical values at room temperature, each with its source. Measure your own where digits matter."""

from __future__ import annotations

from dataclasses import dataclass

from darboux import checks
from darboux.material import Material

CALLISTER = "W. D. Callister and D. G. Rethwisch, Materials Science and Engineering, 8th ed. (2010), tables B.1 to B.4"
ASHBY = "M. F. Ashby, Materials Selection in Mechanical Design, 4th ed. (2011), appendix A"

# Strengths are yield stresses of the strongest ordinary grade or temper, so that what is said to yield does: S460 (EN 1993-1-1,
# table 3.1), 304 and brass cold-worked, 7075-T6, copper H04, Ti-6Al-4V aged (Callister, table B.4).


@dataclass(frozen=True)
class Entry:
    """A material of the library: what it is, its values, and where they come from."""

    words: str
    material: Material
    source: str


LIBRARY = {
    "steel": Entry(
        "structural steel", Material(E=210e9, nu=0.3, density=7850.0, strength=460e6), "EN 1993-1-1 (2005), 3.2.6"
    ),
    "stainless steel": Entry(
        "austenitic, AISI 304", Material(E=193e9, nu=0.3, density=8000.0, strength=515e6), CALLISTER
    ),
    "spring steel": Entry("music wire", Material(E=206e9, G=81.5e9, density=7850.0), "EN 13906-1 (2013)"),
    "nitinol": Entry(
        "nickel-titanium, austenite, up to about 1 % of strain",
        Material(E=70e9, nu=0.33, density=6450.0),
        "T. Duerig, A. Pelton and D. Stöckel, Mater. Sci. Eng. A 273-275 (1999) 149",
    ),
    "aluminium": Entry(
        "wrought alloys", Material(E=70e9, nu=0.3, density=2700.0, strength=505e6), "EN 1999-1-1 (2007), 3.2.5"
    ),
    "copper": Entry("C11000", Material(E=115e9, nu=0.33, density=8890.0, strength=310e6), CALLISTER),
    "brass": Entry(
        "cartridge brass, 70 Cu 30 Zn", Material(E=110e9, nu=0.35, density=8530.0, strength=435e6), CALLISTER
    ),
    "titanium": Entry("Ti-6Al-4V", Material(E=114e9, nu=0.34, density=4430.0, strength=1103e6), CALLISTER),
    "tungsten": Entry("commercially pure", Material(E=400e9, nu=0.28, density=19300.0), CALLISTER),
    "glass": Entry("soda-lime", Material(E=69e9, nu=0.23, density=2500.0), CALLISTER),
    "fused silica": Entry("as in optical fibres", Material(E=73e9, nu=0.17, density=2200.0), CALLISTER),
    "carbon fibre": Entry(
        "60 % high-modulus fibres along the rod, in epoxy; isotropic here, so give your own G where it twists",
        Material(E=220e9, nu=0.25, density=1700.0),
        CALLISTER,
    ),
    "nylon": Entry("nylon 6,6, dry", Material(E=2.7e9, nu=0.39, density=1140.0), CALLISTER),
    "PTFE": Entry("Teflon", Material(E=0.5e9, nu=0.46, density=2170.0), CALLISTER),
    "PEEK": Entry("unfilled", Material(E=3.8e9, nu=0.4, density=1310.0), ASHBY),
    "silicone": Entry(
        "PDMS (Sylgard 184), cured at 25 C",
        Material(E=1.32e6, nu=0.5, density=1030.0),
        "I. D. Johnston and others, J. Micromech. Microeng. 24 (2014) 035017",
    ),
    "rubber": Entry("natural rubber", Material(E=1.5e6, nu=0.5, density=930.0), ASHBY),
    "hair": Entry(
        "human, at medium humidity, along the fibre",
        Material(E=3.9e9, nu=0.37, density=1320.0),
        "C. R. Robbins, Chemical and Physical Behavior of Human Hair, 5th ed. (2012), ch. 9",
    ),
    # EI = 50 nm kT = 205 pN nm^2 and GJ = 410 pN nm^2, taken as those of a solid circle of radius 1 nm.
    "DNA": Entry(
        "the double helix in salt water, as a Circle of radius 1 nm: EI = 205 pN nm^2, GJ = 410 pN nm^2",
        Material(E=2.61e8, G=2.61e8, density=1700.0),
        "Z. Bryant and others, Nature 424 (2003) 338",
    ),
}


def name_of(material: Material) -> str | None:
    """Return the name of a material of the library; None for one of one's own."""
    return next((name for name, entry in LIBRARY.items() if entry.material == material), None)


def named(field: str, name: object) -> Material:
    """Return the material of that name, or suggest the nearest."""
    return LIBRARY[checks.choice(field, name, LIBRARY)].material
