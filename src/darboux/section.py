"""Cross-sections: geometry to stiffness. Axes 1 and 2 of a section lie along its directors d1 and d2."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import profile
from darboux.checks import assign, description
from darboux.errors import InvalidInput
from darboux.material import Material
from darboux.profile import Profile, Varying

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SectionGeometry:
    """Area A (m^2), second moments I1 = int x2^2 dA and I2 = int x1^2 dA, torsion constant J (m^4), shear factors."""

    A: Array
    I1: Array
    I2: Array
    J: Array
    shear1: Array
    shear2: Array


@dataclass(frozen=True)
class SectionStiffness:
    """Bending EI1, EI2 and twist GJ in N m^2; stretch EA and shear GA1, GA2 in N; mass per length in kg/m.

    Each (n,) over the arc lengths asked for; None where the description does not say. ``full`` (n, 6, 6) is the stiffness
    matrix of a ``StiffnessMatrix``, whose diagonal the others are then: each the stiffness with all other strains held.
    """

    EI1: Array
    EI2: Array
    GJ: Array
    EA: Array | None
    GA1: Array | None
    GA2: Array | None
    mass: Array | None
    full: Array | None = None

    @property
    def matrix(self) -> Array:
        """The stiffness matrix [S X^T; X B] (n, 6, 6) in the order (v1, v2, v3, k1, k2, k3); zero where nothing is said."""
        if self.full is not None:
            return self.full
        result = np.zeros((len(self.GJ), 6, 6))
        for i, value in enumerate(self.diagonal):
            if value is not None:
                result[:, i, i] = value
        return result

    @property
    def diagonal(self) -> tuple[Any, ...]:
        """The stiffnesses in the matrix' order, (n,) each or None."""
        return (self.GA1, self.GA2, self.EA, self.EI1, self.EI2, self.GJ)


class Section:
    """What every section offers: its dimensions as profiles, its stiffness along s, its outline where it has a shape."""

    needs_material = True
    coupled = False
    has_shape = True

    def profiles(self) -> dict[str, Profile]:
        """Return the section's own quantities along s, by field name."""
        raise NotImplementedError

    def geometry(self, s: Array, nu: float) -> SectionGeometry:
        """Return the geometry at s (n,), for Poisson's ratio nu."""
        raise NotImplementedError

    def outer_area(self, s: Array) -> Array | None:
        """Return the area in m^2 inside the outline at s (n,), or None where the section has no shape."""
        return self.geometry(s, 0.0).A

    def outline(self, s: Array, p: Array) -> Array:
        """Return the points (x1, x2) of the outer outline in m, (n, m, 2), at s (n,) and the places p (n, m).

        p runs once round the outline from 0 to 4, from d1 towards d2, and smoothly between whole numbers.
        """
        raise NotImplementedError

    def hole(self, s: Array) -> Array:
        """Return the size of the hole over that of the outline, whose form it has, at s (n,); 0 where there is none."""
        return np.zeros_like(s)

    def torsion_shear(self, s: Array, p: Array) -> Array:
        """Return Saint-Venant's shear stress on the outline per unit of torque, (n, m) in 1/m^3, places as in `outline`."""
        raise NotImplementedError

    def stiffness(self, s: Array, material: Material | None) -> SectionStiffness:
        """Return E I1, E I2, G J, E A, G A1, G A2 and rho A at s (n,)."""
        if material is None:
            raise InvalidInput(
                f"rod.material is missing; a {type(self).__name__} section needs one, such as Material(E=1e6, nu=0.5)."
            )
        g = self.geometry(s, material.poisson)
        E, G = material.E, material.shear_modulus
        mass = None if material.density is None else material.density * g.A
        return SectionStiffness(E * g.I1, E * g.I2, G * g.J, E * g.A, g.shear1 * G * g.A, g.shear2 * G * g.A, mass)


def _dimension(name: str, value: Varying) -> Profile:
    return profile.scalar(f"section.{name}", value, "m")


def _circular_shear(nu: float, ratio: Array) -> Array:
    """Cowper's shear coefficient of a tube whose inner radius is ratio times its outer one.

    Source: G. R. Cowper, The shear coefficient in Timoshenko's beam theory, J. Appl. Mech. 33 (1966), table 1.
    """
    p = (1.0 + ratio**2) ** 2
    return np.asarray(6.0 * (1.0 + nu) * p / ((7.0 + 6.0 * nu) * p + (20.0 + 12.0 * nu) * ratio**2))


def _ellipse(a: Array, b: Array, p: Array) -> Array:
    """Return the points (n, m, 2) of ellipses with the semi-axes a, b (n,) at a quarter turn for each unit of p."""
    angle = 0.5 * np.pi * p
    return np.stack([a[:, None] * np.cos(angle), b[:, None] * np.sin(angle)], axis=-1)


@description
class Circle(Section):
    """A solid circular section.

        A = pi r^2,  I1 = I2 = pi r^4 / 4,  J = pi r^4 / 2

    Argument: ``radius`` r in m, a number, a ``Table`` or a function of s. Raises ``InvalidInput`` unless positive.
    """

    radius: Varying

    def __post_init__(self) -> None:
        self.profiles()
        assign(self, radius=profile.frozen(self.radius))

    def profiles(self) -> dict[str, Profile]:
        return {"radius": _dimension("radius", self.radius)}

    def geometry(self, s: Array, nu: float) -> SectionGeometry:
        r = self.profiles()["radius"](s)
        inertia = np.pi * r**4 / 4.0
        shear = _circular_shear(nu, np.zeros_like(r))
        return SectionGeometry(np.pi * r**2, inertia, inertia, 2.0 * inertia, shear, shear)

    def outline(self, s: Array, p: Array) -> Array:
        r = self.profiles()["radius"](s)
        return _ellipse(r, r, p)

    def torsion_shear(self, s: Array, p: Array) -> Array:
        shear = 2.0 / (np.pi * self.profiles()["radius"](s) ** 3)  # r / J
        return np.asarray(np.broadcast_to(shear[:, None], (len(s), p.shape[-1])))


@description
class Tube(Section):
    """A circular tube.

        A = pi (ro^2 - ri^2),  I1 = I2 = pi (ro^4 - ri^4) / 4,  J = 2 I1

    Arguments: ``outer_radius`` ro and ``inner_radius`` ri in m, each a number, a ``Table`` or a function of s.
    Raises ``InvalidInput`` unless 0 < ri < ro.
    """

    outer_radius: Varying
    inner_radius: Varying

    def __post_init__(self) -> None:
        outer, inner = self.profiles().values()
        if outer.constant and inner.constant:
            self._wall(outer(np.zeros(1)), inner(np.zeros(1)))
        assign(self, outer_radius=profile.frozen(self.outer_radius), inner_radius=profile.frozen(self.inner_radius))

    def profiles(self) -> dict[str, Profile]:
        return {name: _dimension(name, getattr(self, name)) for name in ("outer_radius", "inner_radius")}

    @staticmethod
    def _wall(outer: Array, inner: Array) -> None:
        if np.any(inner >= outer):
            place = int(np.argmax(inner >= outer))
            raise InvalidInput(
                f"section.inner_radius is {inner[place]:g} m, but section.outer_radius is {outer[place]:g} m; "
                "the inner radius must be the smaller."
            )

    def outer_area(self, s: Array) -> Array:
        return np.asarray(np.pi * self.profiles()["outer_radius"](s) ** 2)

    def geometry(self, s: Array, nu: float) -> SectionGeometry:
        outer, inner = (p(s) for p in self.profiles().values())
        self._wall(outer, inner)
        inertia = np.pi * (outer**4 - inner**4) / 4.0
        shear = _circular_shear(nu, inner / outer)
        return SectionGeometry(np.pi * (outer**2 - inner**2), inertia, inertia, 2.0 * inertia, shear, shear)

    def outline(self, s: Array, p: Array) -> Array:
        outer = self.profiles()["outer_radius"](s)
        return _ellipse(outer, outer, p)

    def hole(self, s: Array) -> Array:
        outer, inner = (p(s) for p in self.profiles().values())
        return np.asarray(inner / outer)

    def torsion_shear(self, s: Array, p: Array) -> Array:
        shear = self.profiles()["outer_radius"](s) / self.geometry(s, 0.0).J
        return np.asarray(np.broadcast_to(shear[:, None], (len(s), p.shape[-1])))


@description
class Rectangle(Section):
    """A solid rectangle, ``width`` b along d1 and ``height`` h along d2, in m.

        A = b h,  I1 = b h^3 / 12,  I2 = h b^3 / 12
        J = p q^3 [1/3 - (64 q / (pi^5 p)) sum_{n odd} tanh(n pi p / 2 q) / n^5],  p = max(b, h), q = min(b, h)

    Each a number, a ``Table`` or a function of s. Raises ``InvalidInput`` unless positive.
    Source: S. P. Timoshenko and J. N. Goodier, Theory of Elasticity, 3rd ed. (1970), art. 109, eq. 170.
    """

    width: Varying
    height: Varying

    def __post_init__(self) -> None:
        self.profiles()
        assign(self, width=profile.frozen(self.width), height=profile.frozen(self.height))

    def profiles(self) -> dict[str, Profile]:
        return {name: _dimension(name, getattr(self, name)) for name in ("width", "height")}

    def geometry(self, s: Array, nu: float) -> SectionGeometry:
        b, h = (p(s) for p in self.profiles().values())
        p, q = np.maximum(b, h), np.minimum(b, h)
        n = np.arange(1.0, 60.0, 2.0)  # the terms fall as n^-5: the first left out is below 2e-9 of the sum ...
        tail = 31.0 / 32.0 * 1.0369277551433699 - np.sum(n**-5.0)  # ... where tanh = 1, so its sum is known: zeta(5)
        series = np.sum(np.tanh(n * np.pi * (p / q)[:, None] / 2.0) / n**5, axis=1) + tail
        J = p * q**3 * (1.0 / 3.0 - 64.0 * q / (np.pi**5 * p) * series)
        shear = np.full_like(b, 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu))  # Cowper (1966), table 1
        return SectionGeometry(b * h, b * h**3 / 12.0, h * b**3 / 12.0, J, shear, shear)

    def _sides(self, s: Array, p: Array) -> tuple[Array, Array, Array, Array]:
        """Return half of b and of h (n, 1), the side (n, m) that p lies on, and the place on it, from its middle, in m.

        Places lie closer towards the corners, where the shear of torsion falls to zero within the other side's length.
        """
        b, h = (0.5 * value(s)[:, None] for value in self.profiles().values())
        side = np.clip(np.floor(p), 0.0, 3.0) + np.zeros_like(b)
        half, other = np.where(side % 2.0 == 0.0, h, b), np.where(side % 2.0 == 0.0, b, h)
        t = 2.0 * (p - side) - 1.0
        from_corner = 0.5 * other * np.expm1((1.0 - np.abs(t)) * np.log1p(2.0 * half / other))
        return b, h, side, np.sign(t) * (half - from_corner)

    def outline(self, s: Array, p: Array) -> Array:
        b, h, side, along = self._sides(s, p)
        x1 = np.choose(side.astype(int), [b, -along, -b, along])
        x2 = np.choose(side.astype(int), [along, h, -along, -h])
        return np.stack([x1, x2], axis=-1)

    def torsion_shear(self, s: Array, p: Array) -> Array:
        """Saint-Venant's series on the long and the short sides (Timoshenko and Goodier, art. 109)."""
        b, h, side, along = self._sides(s, p)
        long = (side % 2.0 == 0.0) == (h >= b)
        a, c, along = (np.broadcast_to(x, long.shape) for x in (np.minimum(b, h), np.maximum(b, h), np.abs(along)))
        sums = np.empty(long.shape)
        sums[long] = _long_side(a[long], c[long], along[long])
        sums[~long] = _short_side(a[~long], c[~long], along[~long])
        return np.asarray(16.0 * a / (np.pi**2 * self.geometry(s, 0.0).J[:, None]) * sums)


ODD = range(1, 13, 2)  # exp(-pi)^n is below 1e-17 for the first n left out


def _long_side(a: Array, c: Array, y: Array) -> Array:
    """Return sum_{n odd} [1 - cosh(n pi y / 2 a) / cosh(n pi c / 2 a)] / n^2, a <= c half the sides of a rectangle, y >= 0.

    What falls slowly has a closed sum; the rest falls as exp(-n pi c / a).
    """
    near, far = 0.5 * np.pi * (c - y) / a, 0.5 * np.pi * (c + y) / a
    total = 0.125 * np.pi**2 - _chi2(np.exp(-near)) - _chi2(np.exp(-far))
    for n in ODD:
        qn = np.exp(-n * np.pi * c / a)
        total += qn / (1.0 + qn) / n**2 * (np.exp(-n * near) + np.exp(-n * far))
    return np.asarray(total)


def _short_side(a: Array, c: Array, x: Array) -> Array:
    """Return sum_{n odd} tanh(n pi c / 2 a) sin(n u) / n^2, u = pi (a - x) / 2 a, a <= c half the sides of a rectangle, x >= 0.

        sum_{n odd} sin(n u) / n^2 = -(u / 2) ln z + int_0^1 arctan(z t) / t dt,  z = tan(u / 2) <= 1

    takes what falls slowly, its integral by Gauss' rule, exact to rounding; the rest falls as exp(-n pi c / a).
    """
    u = 0.5 * np.pi * (a - x) / a
    z = np.tan(0.5 * u)
    total = -0.5 * u * np.log(np.maximum(z, 1e-300))
    t, w = np.polynomial.legendre.leggauss(12)
    for place, weight in zip(0.5 + 0.5 * t, 0.5 * w, strict=True):
        total += weight / place * np.arctan(z * place)
    for n in ODD:
        qn = np.exp(-n * np.pi * c / a)
        total -= 2.0 * qn / (1.0 + qn) / n**2 * np.sin(n * u)
    return np.asarray(total)


def _chi2(z: Array) -> Array:
    """Return Legendre's chi function, sum_{n odd} z^n / n^2, for 0 <= z <= 1.

        chi2(z) + chi2(x) = pi^2 / 8 - ln z ln x / 2,     x = (1 - z) / (1 + z)

    Of z and x the smaller is not above sqrt(2) - 1, where the series ends at rounding after twenty terms. Source: L. Lewin,
    Polylogarithms and Associated Functions (1981), sec. 1.8.
    """
    x = (1.0 - z) / (1.0 + z)
    small = np.minimum(z, x)
    series = small * np.polynomial.polynomial.polyval(small**2, 1.0 / np.arange(1, 41, 2) ** 2)
    logarithms = np.log(np.maximum(z, 1e-300)) * np.log(np.maximum(x, 1e-300))
    return np.asarray(np.where(z <= x, series, 0.125 * np.pi**2 - 0.5 * logarithms - series))


@description
class Ellipse(Section):
    """A solid ellipse with the semi-axes ``a`` along d1 and ``b`` along d2, in m.

        A = pi a b,  I1 = pi a b^3 / 4,  I2 = pi b a^3 / 4,  J = pi a^3 b^3 / (a^2 + b^2)

    Each a number, a ``Table`` or a function of s. Raises ``InvalidInput`` unless positive.
    """

    a: Varying
    b: Varying

    def __post_init__(self) -> None:
        self.profiles()
        assign(self, a=profile.frozen(self.a), b=profile.frozen(self.b))

    def profiles(self) -> dict[str, Profile]:
        return {name: _dimension(name, getattr(self, name)) for name in ("a", "b")}

    @staticmethod
    def _shear(n: Array, nu: float) -> Array:
        """Cowper (1966), table 1: n is the semi-axis along the shear force over the other one."""
        top = 12.0 * (1.0 + nu) * n**2 * (3.0 * n**2 + 1.0)
        return np.asarray(top / ((40.0 + 37.0 * nu) * n**4 + (16.0 + 10.0 * nu) * n**2 + nu))

    def geometry(self, s: Array, nu: float) -> SectionGeometry:
        a, b = (p(s) for p in self.profiles().values())
        J = np.pi * a**3 * b**3 / (a**2 + b**2)
        return SectionGeometry(
            np.pi * a * b,
            np.pi * a * b**3 / 4.0,
            np.pi * b * a**3 / 4.0,
            J,
            self._shear(a / b, nu),
            self._shear(b / a, nu),
        )

    def outline(self, s: Array, p: Array) -> Array:
        a, b = (value(s) for value in self.profiles().values())
        return _ellipse(a, b, p)

    def torsion_shear(self, s: Array, p: Array) -> Array:
        """Prandtl's 2 / (pi a b) sqrt(x1^2 / a^4 + x2^2 / b^4) (Timoshenko and Goodier, art. 105)."""
        a, b = (value(s)[:, None] for value in self.profiles().values())
        x1, x2 = np.moveaxis(self.outline(s, p), -1, 0)
        return np.asarray(2.0 / (np.pi * a * b) * np.hypot(x1 / a**2, x2 / b**2))


@description
class Stiffness(Section):
    """A section given by its stiffnesses, with no material: measured rods, composites, dimensionless problems.

    Arguments, by name: ``EI1``, ``EI2`` bending stiffness about d1 and d2 and ``GJ`` torsional stiffness in N m^2 (EI2 = EI1
    where not given); ``EA`` stretching and ``GA1``, ``GA2`` shearing stiffness in N, needed only where the rod
    stretches or shears; ``mass`` per length in kg/m, needed only where mass acts. Each a number, a ``Table`` or a
    function of s. Raises ``InvalidInput`` unless positive (mass: not negative).
    """

    _: KW_ONLY
    EI1: Varying
    GJ: Varying
    EI2: Varying | None = None
    EA: Varying | None = None
    GA1: Varying | None = None
    GA2: Varying | None = None
    mass: Varying | None = None

    needs_material = False
    has_shape = False

    def __post_init__(self) -> None:
        if self.EI2 is None:
            assign(self, EI2=self.EI1)
        self.profiles()
        names = ("EI1", "GJ", "EI2", "EA", "GA1", "GA2", "mass")
        assign(self, **{name: profile.frozen(getattr(self, name)) for name in names})

    def profiles(self) -> dict[str, Profile]:
        units = {"EI1": "N m^2", "EI2": "N m^2", "GJ": "N m^2", "EA": "N", "GA1": "N", "GA2": "N", "mass": "kg/m"}
        return {
            name: profile.scalar(
                f"section.{name}", getattr(self, name), unit, "not negative" if name == "mass" else "positive"
            )
            for name, unit in units.items()
            if getattr(self, name) is not None
        }

    def outer_area(self, s: Array) -> None:
        return None

    def stiffness(self, s: Array, material: Material | None) -> SectionStiffness:
        values = {name: p(s) for name, p in self.profiles().items()}
        given: Any = {"EA": None, "GA1": None, "GA2": None, "mass": None} | values
        return SectionStiffness(**given)


@description
class StiffnessMatrix(Section):
    """A section given by its full stiffness matrix: composites, chiral or wound rods, axes turned within the section.

        [R^T n]   [S  X^T] [v - v0]
        [R^T m] = [X  B  ] [k - k0]

    Arguments: ``matrix`` (6, 6), forces first, in the order (v1, v2, v3, k1, k2, k3): shear along d1 and d2, stretch, bending
    about d1 and d2, twist; in N (the block S), N m (X) and N m^2 (B). Or (3, 3), B alone, for a rod that neither stretches
    nor shears. ``mass`` per length in kg/m, needed only where mass acts. Each a constant, a ``Table`` or a function of s
    that returns (n, 6, 6) or (n, 3, 3).
    BeamDyn has the same order. VABS counts the axis along the beam first: its matrix K is here K[np.ix_(p, p)] with
    p = [1, 2, 0, 4, 5, 3], d1 and d2 along its axes 2 and 3.
    A strain that the rod does not have (``stretch=False``, ``shear=False``) is zero; its row and column are not used.
    Raises ``InvalidInput`` unless the matrix is symmetric and positive definite.
    Source: D. H. Hodges, Nonlinear Composite Beam Theory (AIAA, 2006), ch. 4.
    """

    matrix: Varying
    mass: Varying | None = None

    needs_material = False
    coupled = True
    has_shape = False

    def __post_init__(self) -> None:
        self.profiles()
        assign(self, matrix=profile.frozen(self.matrix), mass=profile.frozen(self.mass))

    def profiles(self) -> dict[str, Profile]:
        result = {"matrix": profile.matrix("section.matrix", self.matrix, self._size)}
        if self.mass is not None:
            result["mass"] = profile.scalar("section.mass", self.mass, "kg/m", "not negative")
        return result

    @cached_property
    def _size(self) -> int:
        allowed = "it must be 6 x 6, forces first, or 3 x 3, bending and twist alone"
        try:
            shape = np.shape(self.matrix(np.zeros(1)) if callable(self.matrix) else self.matrix)
        except Exception as error:
            raise InvalidInput(f"section.matrix failed with {type(error).__name__}: {error}; {allowed}.") from error
        if shape[-2:] not in ((3, 3), (6, 6)):
            raise InvalidInput(f"section.matrix has the shape {shape}; {allowed}.")
        return int(shape[-1])

    def outer_area(self, s: Array) -> None:
        return None

    def stiffness(self, s: Array, material: Material | None) -> SectionStiffness:
        values = {name: p(s) for name, p in self.profiles().items()}
        full = np.zeros((len(s), 6, 6))
        K = values["matrix"]
        full[:, -self._size :, -self._size :] = 0.5 * (K + K.transpose(0, 2, 1))
        GA1, GA2, EA, EI1, EI2, GJ = np.diagonal(full, axis1=1, axis2=2).T
        mass = values.get("mass")
        if self._size == 3:
            return SectionStiffness(EI1, EI2, GJ, None, None, None, mass, full)
        return SectionStiffness(EI1, EI2, GJ, EA, GA1, GA2, mass, full)
