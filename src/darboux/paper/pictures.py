"""The paper's figures, drawn from solutions: figures 1 to 7, the convergence of figure 5, and the next steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.paper import cases
from darboux.paper.results import SEGMENTS, Part
from darboux.solution import EquilibriumSolution
from darboux.view import style
from darboux.view.camera import Camera
from darboux.view.palette import BLACK, BLUE, DIRECTORS, GREEN, GREY, VERMILION
from darboux.view.scene import Scene
from darboux.view.tube import cap, tube

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

# -- figures 1 to 4: the geometry of a rod -----------------------------------------------------------------------------

CAMERA = Camera(azimuth=-45.0, elevation=22.0)
ROD = (0.82, 0.87, 0.93)
CUT = (0.97, 0.95, 0.90)
MATERIAL_LINES = (
    (0.0, 0.17, (0.77, 0.27, 0.0)),  # along d1, in its colour
    *((q * np.pi / 2.0, 0.05, (0.52, 0.58, 0.66)) for q in (1, 2, 3)),
)
E3 = np.eye(3)


def draw(name: str, part: Part) -> dict[str, Figure]:
    """Return the pictures of one part of the paper, by file stem; none for a part that has numbers only.

    Arguments: ``name`` a key of ``results.PARTS``; ``part`` what it computed. Matplotlib's settings stay as they are.
    """
    painters = _PAINTERS.get(name, {})
    with style.article():
        return {stem: paint(part) for stem, paint in painters.items()}


def _figure1(part: Part) -> Figure:
    """The rod with its directors: r(s), d1, d2, d3, and the material line that d1 leads along."""
    rod = part.solutions["rod"]
    L, size = rod.problem.rod.length, 0.13
    figure = style.new_figure(8.0, 4.5)
    scene = Scene.at(figure, (0.0, 0.0, 8.0, 4.5), CAMERA)
    _rod(scene, rod, 0.0, L)
    places = np.array([0.04, 0.40, 0.68, 0.94]) * L
    for i, s in enumerate(places):
        _directors(scene, rod.r(s), rod.R(s), size, argument="(s)" if i == 1 else "")
    _fixed_frame(scene, 0.2)
    _position(scene, rod.r(places[1]), (8.0, -14.0))
    scene.text(rod.r(0.0), r"$s = 0$", (-14.0, 36.0))
    scene.text(rod.r(L), rf"$s = L = {L:g}\ \mathrm{{m}}$", (10.0, 34.0))
    scene.fit(_extent(rod), (0.5, 1.0, 0.6, 0.4))
    _note(
        figure,
        rf"Length of $\mathbf{{e}}_i$: 0.2 m; of $\mathbf{{d}}_i$: {size} m.  "
        r"The broad line on the rod is the material line on the side of $\mathbf{d}_1$.",
    )
    return figure


def _figure2(part: Part) -> Figure:
    """A segment cut out of the rod, with what acts on it: contact forces and moments at a and b, weight along it."""
    rod = part.solutions["rod"]
    L = rod.problem.rod.length
    a, b = 0.3 * L, 0.7 * L
    newton, newton_metre, per_metre = 0.25, 0.4, 0.125  # m drawn for 1 N, 1 N m, 1 N/m
    figure = style.new_figure(8.0, 4.6)
    scene = Scene.at(figure, (0.0, 0.0, 8.0, 4.6), CAMERA)
    _rod(scene, rod, 0.0, a, strength=0.28, zorder=1.0)
    _rod(scene, rod, b, L, strength=0.28, zorder=1.0)
    _rod(scene, rod, a, b)
    f = rod.problem.distributed(np.array([0.5 * L])).a[0]
    for s in np.linspace(a, b, 9)[1:-1]:
        scene.arrow(rod.r(s), per_metre * f, colour="#4d4d4d", width=1.1, head=8.0, zorder=5.0)
    words = rf"$\mathbf{{f}}(s)$, {np.linalg.norm(f):.2f} N/m"
    scene.text(rod.r(0.5 * (a + b)) + per_metre * f, words, (-6.0, -16.0), ha="right")
    for s, sign, side, letter, offsets in (
        (a, -1.0, "-", "a", ((-4.0, -14.0), (-4.0, 15.0))),
        (b, 1.0, "+", "b", ((5.0, 8.0), (5.0, -15.0))),
    ):
        minus = "-" if sign < 0.0 else ""
        for vector, scale, unit, colour, name, heads, offset in (
            (sign * rod.n(s), newton, "N", BLUE, "n", 1, offsets[0]),
            (sign * rod.m(s), newton_metre, "N m", VERMILION, "m", 2, offsets[1]),
        ):
            scene.arrow(rod.r(s), scale * vector, colour=colour, width=2.2, head=15.0, heads=heads, halo=0.8)
            words = rf"${minus}\mathbf{{{name}}}^{side}({letter})$, {np.linalg.norm(vector):.2f} {unit}"
            scene.text(rod.r(s) + scale * vector, words, offset, color=colour, ha="right" if sign < 0.0 else "left")
        scene.dot(rod.r(s), ms=4.0)
        scene.text(rod.r(s), rf"$s = {letter}$", (-2.0, 30.0))
    _fixed_frame(scene, 0.1)
    scene.fit(_extent(rod), (0.65, 0.8, 0.75, 0.35))
    _note(
        figure,
        r"The segment $[a, b]$ is in balance under its weight "
        "and the contact forces and moments (two heads) of its neighbours.\n"
        rf"Scales: 0.1 m in the picture is {0.1 / newton:g} N, {0.1 / newton_metre:g} N m and {0.1 / per_metre:g} N/m;"
        r" $\mathbf{e}_i$ are 0.1 m long.",
    )
    return figure


def _figure3(part: Part) -> Figure:
    """A material point of a section, r(s) + x1 d1 + x2 d2: where the section is, and the section itself enlarged."""
    rod = part.solutions["rod"]
    L, radius = rod.problem.rod.length, rod.problem.rod.section.radius
    s = 0.45 * L
    r, R = rod.r(s), rod.R(s)
    ring = r + radius * _circle(R)
    figure = style.new_figure(8.0, 4.2)
    left = Scene.at(figure, (0.0, 0.2, 4.7, 3.7), CAMERA)
    _rod(left, rod, 0.0, s)
    _rod(left, rod, s, L, strength=0.28, zorder=1.0)
    left.line(ring, color=BLACK, lw=1.2, zorder=4.0)
    _fixed_frame(left, 0.2)
    _position(left, r, (-10.0, 11.0))
    left.dot(r, ms=3.5)
    left.text(r, "section at $s$", (14.0, 34.0))
    left.fit(_extent(rod), (0.35, 0.3, 0.6, 0.5))
    _section(figure, rod, s)
    left.ax.set_title("(a)  the section in the rod", loc="left", x=0.06, y=0.95)
    _note(
        figure,
        r"Material point: $\mathbf{p}(x_1, x_2, s) = \mathbf{r}(s) + x_1 \mathbf{d}_1(s) + x_2 \mathbf{d}_2(s)$,  "
        r"$\mathbf{d}_i = Q\, \mathbf{e}_i$.  In (a) $\mathbf{e}_i$ are 0.2 m long.",
    )
    return figure


def _section(figure: Figure, rod: EquilibriumSolution, s: float) -> None:
    """Draw the rod cut open at s, with a material point of the section, from a camera that looks at the cut."""
    radius = rod.problem.rod.section.radius
    r, R = rod.r(s), rod.R(s)
    azimuth = float(np.degrees(np.arctan2(R[1, 2], R[0, 2])))
    camera = Camera(azimuth=azimuth + 36.0, elevation=24.0)
    scene = Scene.at(figure, (4.7, 0.2, 3.3, 3.7), camera)
    _rod(scene, rod, s - 1.6 * radius, s, around=96)
    scene.line(r + radius * _circle(R), color=BLACK, lw=1.0, zorder=4.0)
    x = np.array([0.66, 0.45]) * radius
    x1, x2 = x[0] * R[:, 0], x[1] * R[:, 1]
    _directors(scene, r, R, 1.7 * radius, argument="(s)")
    for start, vector in ((r + x1, x2), (r + x2, x1)):
        scene.line(np.stack([start, start + vector]), color=BLACK, lw=1.0, linestyle=(0, (3, 2)), zorder=6.5)
    scene.arrow(r, x1 + x2, colour=BLACK, width=1.5, head=10.0, zorder=6.6, halo=0.6)
    scene.dot(r + x1 + x2, ms=6.0, zorder=8.0, markerfacecolor="white", markeredgewidth=1.6)
    scene.text(r + x1 + x2, r"$\mathbf{p}$", (9.0, 6.0))
    scene.text(r + 0.5 * x1 - 0.2 * radius * R[:, 1], r"$x_1$", color=DIRECTORS[0])
    scene.text(r + 0.75 * x2 - 0.2 * radius * R[:, 0], r"$x_2$", color=DIRECTORS[1])
    incoming = r / np.linalg.norm(r) * 2.2 * radius
    scene.arrow(r - incoming, incoming, colour=GREY, width=1.3, head=11.0, zorder=5.5, halo=0.6)
    scene.text(r - incoming, r"$\mathbf{r}(s)$", (0.0, -10.0), color="#4d4d4d")
    points = r + radius * np.vstack([_circle(R), 1.75 * R.T, _circle(R) - 1.6 * R[:, 2]])
    scene.fit(np.vstack([points, r - incoming]), (0.3, 0.35, 0.75, 0.55))
    scene.scale_bar(0.02, "2 cm", (0.60, 0.10))
    scene.ax.set_title("(b)  the section, enlarged", loc="left", x=0.04, y=0.95)


def _figure4(part: Part) -> Figure:
    """The rotation Q(s) that takes the fixed frame e_i to the material frame d_i."""
    rod = part.solutions["rod"]
    L = rod.problem.rod.length
    s = 0.88 * L
    camera = Camera(azimuth=-65.0, elevation=28.0)
    r, R = rod.r(s), rod.R(s)
    q = frames.quaternion_of_matrix(R)
    q = q if q[0] >= 0.0 else -q
    angle = 2.0 * np.arctan2(np.linalg.norm(q[1:]), q[0])
    axis = q[1:] / np.linalg.norm(q[1:])
    figure = style.new_figure(8.0, 4.2)
    left = Scene.at(figure, (0.0, 0.2, 4.6, 3.7), camera)
    _rod(left, rod, 0.0, L, strength=0.45)
    _fixed_frame(left, 0.2)
    _directors(left, r, R, 0.2, argument="(s)")
    left.fit(_extent(rod), (0.35, 0.3, 0.6, 0.6))
    ways = np.linspace(0.0, 1.0, 40)[:, None]
    bow = 0.10 * np.sin(np.pi * ways) * (left.camera.A[0] - 0.8 * left.camera.A[1])
    path = 0.05 * r + ways * 0.86 * r + bow
    left.arc(path, colour="#4d4d4d", head=11.0)
    left.text(path[16], r"$Q(s)$", (2.0, -11.0), color="#4d4d4d")
    left.ax.set_title("(a)  the two frames", loc="left", x=0.06, y=0.95)
    right = Scene.at(figure, (4.6, 0.2, 3.4, 3.7), camera)
    right.line(np.array([-0.45, 1.25])[:, None] * axis, color=GREY, lw=1.2, linestyle=(0, (6, 2, 1, 2)), zorder=4.0)
    right.text(1.25 * axis, "axis", (0.0, 8.0), color="#4d4d4d")
    for i in range(3):
        arc = np.array(
            [frames.matrix_of_quaternion(_quaternion(axis, t * angle)) @ E3[i] for t in np.linspace(0.06, 0.94, 40)]
        )
        right.arc(arc, colour=DIRECTORS[i], width=1.1, head=8.0, zorder=4.5, style=(0, (4, 2)))
    _fixed_frame(right, 1.0)
    _directors(right, np.zeros(3), R, 1.0)
    right.fit(np.vstack([E3, R.T, -0.45 * axis, 1.25 * axis]), (0.35, 0.35, 0.75, 0.55))
    right.ax.set_title(rf"(b)  one turn by {np.degrees(angle):.0f}$\degree$", loc="left", x=0.04, y=0.95)
    _note(
        figure,
        rf"$\mathbf{{d}}_i(s) = Q(s)\, \mathbf{{e}}_i$ at $s = {s:g}$ m.  "
        r"In (a) $\mathbf{e}_i$ and $\mathbf{d}_i$ are 0.2 m long; in (b) they have one origin.",
    )
    return figure


def _quaternion(axis: Array, angle: float) -> Array:
    return np.concatenate([[np.cos(angle / 2.0)], np.sin(angle / 2.0) * axis])


def _circle(R: Array) -> Array:
    """Return the unit circle round the section with the directors R: (73, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    return np.cos(angle)[:, None] * R[:, 0] + np.sin(angle)[:, None] * R[:, 1]


def _rod(
    scene: Scene,
    solution: EquilibriumSolution,
    a: float,
    b: float,
    *,
    strength: float = 1.0,
    zorder: float = 2.0,
    around: int = 32,
) -> None:
    """Draw the rod between a and b as a shaded tube with both ends closed."""
    L = solution.problem.rod.length
    s = np.linspace(a, b, max(8, round(110 * (b - a) / L)))
    r, R, radius = solution.r(s), solution.R(s), solution.problem.rod.section.radius
    view = scene.camera.A
    faces = tube(r, R, radius, view, colour=ROD, lines=MATERIAL_LINES, around=around)
    for i, outward in ((0, -1.0), (-1, 1.0)):
        faces = faces + cap(r[i], R[i], radius, view, colour=CUT, outward=outward)
    scene.faces(faces, zorder, strength)


def _hull(solution: EquilibriumSolution) -> Array:
    """Return points round the rod, for a picture's extent."""
    s = np.linspace(0.0, solution.problem.rod.length, 40)
    r, R, radius = solution.r(s), solution.R(s), solution.problem.rod.section.radius
    return np.concatenate([r + radius * sign * R[:, :, i] for i in (0, 1) for sign in (-1.0, 1.0)])


def _extent(solution: EquilibriumSolution) -> Array:
    """Return points round the rod and the fixed frame."""
    return np.vstack([_hull(solution), np.zeros(3), 0.2 * E3])


def _directors(scene: Scene, r: Array, R: Array, size: float, *, argument: str = "", width: float = 2.0) -> None:
    """Draw d1, d2, d3 at r, each in its colour with its name, those further from the viewer first."""
    for order, i in enumerate(np.argsort(scene.camera.depth(R.T))):
        scene.arrow(r, size * R[:, i], colour=DIRECTORS[i], width=width, head=12.0, zorder=6.0 + 0.1 * order, halo=0.8)
        gap = 9.0 + 7.0 * abs(float(scene.camera.project(R[:, i])[0])) * bool(argument)
        scene.label_arrow(r, size * R[:, i], rf"$\mathbf{{d}}_{i + 1}{argument}$", gap, color=DIRECTORS[i])
    scene.dot(r, ms=3.5, zorder=7.0)


def _fixed_frame(scene: Scene, size: float, origin: Any = (0.0, 0.0, 0.0)) -> None:
    """Draw e1, e2, e3 with their names."""
    for i in range(3):
        scene.arrow(origin, size * E3[i], colour=BLACK, width=1.3, head=11.0, zorder=5.0)
        scene.label_arrow(origin, size * E3[i], rf"$\mathbf{{e}}_{i + 1}$", 10.0)
    scene.dot(origin, ms=3.0)


def _position(scene: Scene, r: Array, offset: tuple[float, float]) -> None:
    """Draw r(s) from the origin to the centreline."""
    scene.arrow((0, 0, 0), r, colour=GREY, width=1.3, head=11.0, zorder=5.5, halo=0.6)
    scene.text(0.55 * r, r"$\mathbf{r}(s)$", offset, color="#4d4d4d")


def _note(figure: Figure, words: str) -> None:
    """Write one line under the picture."""
    height = figure.get_size_inches()[1]
    figure.text(0.5, 0.12 / height, words, ha="center", va="bottom", fontsize=10.0, color="#4d4d4d")


# -- figure 5: the cantilever under its own weight ---------------------------------------------------------------------

CM = 100.0
METHODS5: dict[str, tuple[str, dict[str, Any]]] = {  # name: legend, line; in the order of drawing
    "shooting": ("Kirchhoff, shooting", {"color": "#a3d3f2", "lw": 6.0, "zorder": 2.0}),
    "elastica": ("Euler's elastica", {"color": BLACK, "lw": 1.4, "ls": (0, (4, 2.2)), "zorder": 3.0}),
    "discrete_5": (
        "DER, 5 vertices",
        {"color": VERMILION, "lw": 1.3, "marker": "o", "ms": 7.5, "mec": "white", "mew": 0.6, "zorder": 4.0},
    ),
    "discrete_30": (
        "DER, 30 vertices",
        {"color": VERMILION, "lw": 0.9, "marker": "o", "ms": 4.4, "mec": "white", "mew": 0.5, "zorder": 4.2},
    ),
    "discrete_5_two_vertices": (
        "DER, 5 vertices, two of them held",
        {
            "color": GREEN,
            "lw": 1.3,
            "ls": (0, (1, 1.2)),
            "marker": "s",
            "ms": 6.5,
            "mfc": "white",
            "mew": 1.4,
            "zorder": 3.6,
        },
    ),
    "discrete_30_two_vertices": (
        "DER, 30 vertices, two of them held",
        {
            "color": GREEN,
            "lw": 1.0,
            "ls": (0, (1, 1.2)),
            "marker": "s",
            "ms": 3.6,
            "mfc": "white",
            "mew": 0.9,
            "zorder": 3.8,
        },
    ),
}


def _figure5(part: Part) -> Figure:
    """The centreline by every method in the inextensible model: the rod, its bend at the clamp, the distances."""
    solutions = {name: part.solutions[f"inextensible.{name}"] for name in METHODS5}
    figure = style.new_figure(8.0, 5.3)
    whole = style.axes_at(figure, 0.62, 0.55, 1.40, 3.78)  # 10 by 27 cm
    bend = style.axes_at(figure, 2.62, 0.55, 2.48, 3.78)  # 2.3 by 3.5 cm
    gaps = style.axes_at(figure, 6.0, 0.55, 1.85, 3.78)
    for ax in (whole, bend):
        for name, (label, line) in METHODS5.items():
            x, _, z = CM * _points(solutions[name], 801).T
            ax.plot(x, z, label=label, **line)
        ax.set_xlabel("$x$ (cm)")
        ax.set_ylabel("$z$ (cm)", labelpad=1.0)
    low = np.array([-0.31, -3.2])
    high = low + np.array([2.30, 2.30 * 3.78 / 2.48])
    whole.set(xlim=(-1.4, 8.6), ylim=(-25.9, 1.1), aspect="equal", xticks=[0, 4, 8])
    bend.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xticks=[0, 1, 2], yticks=[-3, -2, -1, 0])
    _wall(whole, 1.4, 2.2)
    _wall(bend, 0.31, 0.56)
    _lens(whole, low, high, "b")
    bend.spines[["top", "right"]].set_visible(True)
    style.gravity_arrow(whole, 0.60, 0.50, 30.0)
    reference = solutions["shooting"]
    L = reference.problem.rod.length
    for name, (label, line) in METHODS5.items():
        if name != "shooting":
            s = np.linspace(0.0, L, 61)[1:] if name == "elastica" else solutions[name].s[1:]
            gap = np.linalg.norm(solutions[name].r(s) - reference.r(s), axis=1) / L
            gaps.semilogy(CM * s, np.where(gap > 0.0, gap, np.nan), label=label, **line)
    gaps.set(xlim=(0.0, 26.0), ylim=(1e-16, 2.0), xticks=[0, 10, 20], yticks=10.0 ** np.arange(-16, 1, 4))
    gaps.yaxis.set_minor_locator(_decades(-16, 0))
    gaps.yaxis.set_minor_formatter("")
    gaps.grid(True, axis="y")
    gaps.set_xlabel("$s$ (cm)")
    gaps.set_ylabel(r"distance from shooting, $|\Delta \mathbf{r}| / L$", labelpad=2.0)
    style.panel_label(whole, "a", "the rod", x=-0.30)
    style.panel_label(bend, "b", "its bend at the clamp", x=-0.1)
    style.panel_label(gaps, "c", "distances along it", x=-0.30)
    handles, labels = whole.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="upper center", ncols=3, bbox_to_anchor=(0.5, 0.995), handletextpad=0.6, labelspacing=0.35
    )
    return figure


def _points(solution: EquilibriumSolution, samples: int) -> Array:
    """Return the vertices of a discrete rod, or points close together on the curve of a continuous method: (n, 3)."""
    discrete = hasattr(solution.method, "refined")
    return solution.r(solution.s if discrete else np.linspace(0.0, solution.problem.rod.length, samples))


def _wall(ax: Axes, width: float, height: float, x: float = 0.0, z: float = 0.0) -> None:
    """Draw the wall that clamps an end at (x, z), to its left."""
    from matplotlib.patches import Rectangle

    ax.add_patch(
        Rectangle(
            (x - width, z - height / 2.0),
            width,
            height,
            facecolor="white",
            edgecolor="#8c8c8c",
            hatch="/////",
            lw=0.0,
            zorder=1.0,
        )
    )
    ax.plot([x, x], [z - height / 2.0, z + height / 2.0], color=BLACK, lw=1.6, zorder=1.5, solid_capstyle="butt")


def _lens(whole: Axes, low: Array, high: Array, letter: str) -> None:
    """Frame in ``whole`` what the panel ``letter`` shows enlarged."""
    from matplotlib.patches import Rectangle

    whole.add_patch(Rectangle(tuple(low), *(high - low), fill=False, lw=0.9, edgecolor="#4d4d4d", zorder=5.0))
    whole.annotate(
        f"({letter})", (high[0], low[1]), xytext=(4.0, 1.0), textcoords="offset points", va="bottom", fontsize=10.0
    )


def _decades(first: int, last: int) -> Any:
    from matplotlib.ticker import FixedLocator

    return FixedLocator(list(10.0 ** np.arange(first, last + 1)))


def _figure5_convergence(part: Part) -> Figure:
    """The error of the tip over the number of segments, both clamps and both models, with the orders observed."""
    figure = style.new_figure(6.6, 4.6)
    ax = style.axes_at(figure, 0.85, 0.62, 5.5, 3.7)
    N = np.array(SEGMENTS, dtype=float)
    looks = {
        "two_vertices": ("two vertices held (the paper's clamp)", GREEN, "s"),
        "half_cell": ("half-cell clamp (the default)", VERMILION, "o"),
    }
    for clamp, (label, colour, marker) in looks.items():
        for model, filled in (("inextensible", False), ("stretch", True)):
            errors = np.array(part.data[model][clamp])
            look: dict[str, Any] = (
                {"ms": 4.5, "mfc": colour, "ls": "-", "zorder": 3.0}
                if filled
                else {"ms": 8.5, "mfc": "white", "ls": "none"}
            )
            ax.loglog(
                N, errors, color=colour, marker=marker, mew=1.3, lw=1.4, label=f"{label}; {MODELS[model]}", **look
            )
        orders = np.log2(errors[:-1] / errors[1:])
        for i, order in ((i, order) for i, order in enumerate(orders) if np.isfinite(order)):
            ax.annotate(
                f"{order:.2f}", (np.sqrt(N[i] * N[i + 1]), np.sqrt(errors[i] * errors[i + 1])), xytext=(5.0, 6.0),
                textcoords="offset points", fontsize=9.0, color="#4d4d4d",
            )  # fmt: skip
    last = {clamp: part.data["stretch"][clamp][-1] for clamp in looks}
    for clamp, order in (("two_vertices", 1), ("half_cell", 2)):
        _slope(ax, 360.0, last[clamp] * (1024.0 / 360.0) ** order / 2.2, order)
    ax.set(xlim=(6.5, 1350.0), ylim=(1.5e-6, 0.5))
    ax.set_xticks(N, [f"{n:g}" for n in N])
    ax.minorticks_off()
    ax.grid(True)
    ax.set_xlabel("number of segments $N$")
    ax.set_ylabel(r"error of the tip, $|\Delta \mathbf{r}(L)| / L$")
    ax.legend(
        loc="lower left",
        borderaxespad=0.8,
        labelspacing=0.35,
        frameon=True,
        facecolor="white",
        edgecolor="none",
        framealpha=1.0,
    )
    return figure


MODELS = {"inextensible": "inextensible", "stretch": "with stretch"}


def _slope(ax: Axes, n: float, error: float, order: int) -> None:
    """Draw the triangle of a slope below a line, one octave wide, with its order."""
    x = np.array([n, 2.0 * n, n, n])
    y = error * np.array([1.0, 2.0**-order, 2.0**-order, 1.0])
    ax.plot(x, y, color=BLACK, lw=0.9, zorder=2.0)
    ax.annotate(
        f"{order}",
        (n, error * 2.0 ** (-order / 2)),
        xytext=(-4.0, 0.0),
        textcoords="offset points",
        ha="right",
        va="center",
        fontsize=9.5,
    )
    ax.annotate(
        "1",
        (n * np.sqrt(2.0), y[1]),
        xytext=(0.0, -3.0),
        textcoords="offset points",
        ha="center",
        va="top",
        fontsize=9.5,
    )


# -- figure 6: a terminal moment ---------------------------------------------------------------------------------------

METHODS6: dict[str, tuple[str, dict[str, Any]]] = {
    "exact": ("exact helix", {"color": "#a3d3f2", "lw": 6.5, "zorder": 2.0}),
    "initial_value": ("initial value problem", {"color": BLUE, "lw": 1.6, "zorder": 3.0}),
    "shooting": (
        "boundary value problem",
        {"color": BLACK, "lw": 2.6, "ls": (0, (0.1, 3.2)), "dash_capstyle": "round", "zorder": 3.5},
    ),
    "discrete_100": (
        "DER, 100 segments, every 4th vertex",
        {
            "color": VERMILION,
            "lw": 0.0,
            "ls": "none",
            "marker": "o",
            "ms": 5.5,
            "mfc": "white",
            "mew": 1.4,
            "zorder": 4.0,
        },
    ),
}


def _figure6(part: Part) -> Figure:
    """The helix under a terminal moment: by three methods and exactly, in space, along its axis, and in numbers."""
    problem = part.solutions["shooting"].problem
    moment = problem.end_load("end").moment
    axis = moment / np.linalg.norm(moment)
    s = np.linspace(0.0, problem.rod.length, 401)
    lines = {"exact": CM * part.data["exact"]}
    lines |= {name: CM * x.r(x.s[::4] if name.startswith("discrete") else s) for name, x in part.solutions.items()}
    # The axis passes at axis x p / |w| from r(0), p the part of the tangent across it (see cases.exact_helix6).
    tangent = problem.start.R[:, 2]
    curvature = float(np.linalg.norm(moment)) / cases.FIGURE6_EI
    centre = CM * np.cross(axis, tangent) / curvature
    figure = style.new_figure(8.0, 5.0)
    camera = Camera(azimuth=-64.0, elevation=22.0)
    scene = Scene.at(figure, (0.0, 0.0, 5.0, 4.45), camera)
    corners = scene.box((-1.0, -5.0, 0.0), (16.0, 5.0, 10.0), (5.0, 4.0, 5.0), ("$x$ (cm)", "$y$ (cm)", "$z$ (cm)"))
    for name, (label, line) in METHODS6.items():
        scene.line(lines[name], label=label, **line)
    along = (lines["exact"] - centre) @ axis
    foot = centre + (along.min() + 0.5) * axis
    scene.arrow(
        foot, (along.max() - along.min() - 0.5) * axis, colour=VERMILION, width=1.6, head=13.0, heads=2, zorder=2.5
    )
    scene.text(foot, r"$\mathbf{m}$", (9.0, 3.0), color=VERMILION)
    scene.fit(corners, (0.62, 0.1, 0.55, 0.12))
    scene.ax.set_title("(a)  in space", loc="left", x=0.04, y=0.965)
    _along_axis(figure, lines, axis, centre, part.numbers["figure6"]["exact"]["radius"])
    _helix_table(figure, part.numbers["figure6"])
    handles, labels = scene.ax.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="upper center", ncols=4, bbox_to_anchor=(0.5, 0.995), handletextpad=0.6, columnspacing=1.3
    )
    return figure


def _along_axis(figure: Figure, lines: dict[str, Array], axis: Array, centre: Array, radius: float) -> None:
    """Draw the helix as seen along the moment, where it is a circle."""
    ax = style.axes_at(figure, 5.62, 1.93, 2.2, 2.2)
    camera = Camera(
        azimuth=float(np.degrees(np.arctan2(-axis[1], -axis[0]))), elevation=float(np.degrees(np.arcsin(-axis[2])))
    )
    for name, (_, line) in METHODS6.items():
        ax.plot(*camera.project(lines[name] - centre).T, **line)
    a = CM * radius
    turn = np.radians(35.0)
    ax.annotate(
        "",
        (a * np.cos(turn), a * np.sin(turn)),
        (0.0, 0.0),
        arrowprops={"arrowstyle": "-|>", "lw": 1.2, "color": BLACK, "shrinkA": 0.0, "shrinkB": 2.0},
    )
    ax.annotate(rf"$a$ = {a:.4f} cm", (0.0, -0.25), ha="center", va="top", fontsize=10.0)
    ax.plot(0.0, 0.0, marker="o", ms=8.0, mfc="white", mec=VERMILION, mew=1.4)
    ax.plot(0.0, 0.0, marker="x", ms=4.5, color=VERMILION, mew=1.4)
    ax.set(xlim=(-3.4, 3.4), ylim=(-3.4, 3.4), aspect="equal", xticks=[-2, 0, 2], yticks=[-2, 0, 2])
    ax.set_xlabel("across the axis (cm)", labelpad=2.0)
    ax.set_ylabel("across the axis (cm)", labelpad=0.0)
    style.panel_label(ax, "b", r"along $\mathbf{m}$", x=-0.2)


def _helix_table(figure: Figure, numbers: dict[str, Any]) -> None:
    """Write radius and pitch by each method, and its distance from the exact helix."""
    width, height = figure.get_size_inches()
    columns = (5.06, 6.52, 7.20, 7.90)
    rows = [("", "radius", "pitch", r"$|\Delta\mathbf{r}|/L$"), ("", "(mm)", "(mm)", "largest")]
    for name, words in (
        ("exact", "exact"),
        ("initial_value", "initial value"),
        ("shooting", "boundary value"),
        ("discrete_100", "DER, 100"),
    ):
        found = numbers[name]
        gap = found.get("centreline_distance")
        gap = "" if gap is None else rf"${style.power_of_ten(float(f'{gap:.0e}'))}$"
        rows.append((words, f"{1e3 * found['radius']:.5f}", f"{1e3 * found['pitch']:.5f}", gap))
    for i, row in enumerate(rows):
        for j, (x, words) in enumerate(zip(columns, row, strict=True)):
            y = (1.28 - 0.19 * i - 0.05 * (i > 1)) / height
            figure.text(x / width, y, words, ha="left" if j == 0 else "right", va="center", fontsize=9.5)


# -- figure 7: two helices under gravity -------------------------------------------------------------------------------


def _figure7(part: Part) -> Figure:
    """The two helices under gravity, in both readings: (a) the printed initial value problem, (b) natural curvature."""
    figure = style.new_figure(8.0, 7.4)
    readings = {
        "a": r"(a)  straight rod, integrated from the printed "
        r"$\mathbf{k}(0) = (0, 2, 0.1)\ \mathrm{m}^{-1}$, $\mathbf{n}(0) = 0$",
        "b": r"(b)  natural curvature $\mathbf{k}_0 = (0, 2, 0.1)\ \mathrm{m}^{-1}$, one end clamped, the other free",
    }
    boxes: dict[str, tuple[Any, Any]] = {
        "a.vertical": ((-1.25, -0.75, -1.75), (0.25, 0.75, 0.25)),
        "a.horizontal": ((-0.25, -1.25, -0.75), (1.75, 0.75, 1.0)),
        "b.vertical": ((-0.25, -0.75, -2.25), (1.25, 0.75, 0.25)),
        "b.horizontal": ((-0.5, -1.25, -1.5), (1.5, 0.25, 0.75)),
    }
    labels = ("$x$ (m)", "$y$ (m)", "$z$ (m)")
    for row, reading in enumerate("ab"):
        top = 7.4 - 0.1 - 3.4 * row
        figure.text(0.3 / 8.0, (top - 0.12) / 7.4, readings[reading], va="center", fontsize=11.0)
        for column, orientation in enumerate(("vertical", "horizontal")):
            name = f"{reading}.{orientation}"
            elevation = 14.0 if name == "a.vertical" else 20.0  # from where its turns hide each other least
            camera = Camera(azimuth=-62.0, elevation=elevation)
            scene = Scene.at(figure, (0.1 + 3.95 * column, top - 3.35, 3.85, 3.0), camera)
            low, high = boxes[name]
            scene.fit(scene.box(low, high, (0.5, 0.5, 0.5), labels), (0.60, 0.45, 0.5, 0.28))
            s = np.linspace(0.0, cases.FIGURE7_LENGTH, 641)
            if reading == "b":
                scene.curve(part.solutions[f"{name}.natural"].r(s), width=1.7, colour="#c9c9c9", halo=0.7, zorder=2.0)
            scene.curve(part.solutions[name].r(s), width=1.9, colour=BLUE, halo=0.7)
            scene.dot(part.solutions[name].r(0.0), marker="s", ms=5.0)
            scene.ax.set_title(f"helix axis {orientation}", x=0.5, y=0.93)
            style.gravity_arrow(scene.ax, 0.93, 0.62, 26.0)
    weight = cases.FIGURE7_WEIGHT
    _note(
        figure,
        "Square: start of integration (a), clamp (b). Grey: natural shape. "
        "The paper prints neither units nor length nor weight;\n"
        rf"here SI units, $L$ = {cases.FIGURE7_LENGTH:g} m, weight {weight['a']:g} N/m in (a), "
        rf"{weight['b']:g} N/m in (b).",
    )
    return figure


# -- the paper's next steps: a rotating and a charged filament ---------------------------------------------------------


RAMP = ("#a6cee3", "#74aed4", "#4a8cc2", "#2a68a8", "#174884", "#0a2550")  # light to dark: ordered in grey as well


def _rotating(part: Part) -> Figure:
    """The filament on a hub that turns about the vertical, at several speeds, in the plane that turns with it."""
    from matplotlib.patches import Rectangle

    figure = style.new_figure(7.0, 6.3)
    ax = style.axes_at(figure, 0.85, 0.62, 5.95, 5.4)
    offsets = {0.0: (-2.0, -6.0, "right", "top"), 0.8: (3.0, -5.0, "left", "top")}
    for (f, solution), colour in zip(part.solutions.items(), RAMP, strict=False):
        r, _, z = _points(solution, 401).T
        ax.plot(r, z, color=colour, lw=2.4)
        x, y, ha, va = offsets.get(float(f), (6.0, -2.0, "left", "center"))
        words = f"{f} turns/s" if float(f) else "at rest"
        ax.annotate(words, (r[-1], z[-1]), xytext=(x, y), textcoords="offset points", ha=ha, va=va)
    hub = next(iter(part.solutions.values())).r(0.0)
    ax.add_patch(Rectangle((0.0, -0.009), hub[0], 0.018, facecolor="white", edgecolor="#8c8c8c", hatch="/////", lw=0.0))
    ax.plot([hub[0]] * 2, [-0.009, 0.009], color=BLACK, lw=1.6, solid_capstyle="butt")
    ax.axvline(0.0, color=GREY, lw=1.2, ls=(0, (9, 2, 1.5, 2)), zorder=0.5)
    _turning(ax, 0.0, 0.036, 0.013)
    ax.annotate(
        "axis of rotation", (0.0, 0.036), xytext=(26.0, 0.0), textcoords="offset points", va="center", color="#4d4d4d"
    )
    ax.annotate(
        "hub",
        (hub[0] / 2.0, -0.009),
        xytext=(0.0, -4.0),
        textcoords="offset points",
        ha="center",
        va="top",
        fontsize=10.0,
    )
    ax.set(xlim=(-0.022, 0.34), ylim=(-0.274, 0.0546), aspect="equal")
    ax.set_xlabel("distance from the axis $r$ (m)")
    ax.set_ylabel("$z$ (m)")
    style.gravity_arrow(ax, 0.84, 0.42, 34.0)
    return figure


def _turning(ax: Axes, x: float, z: float, size: float) -> None:
    """Draw the arrow round a vertical axis that says that the system turns about it."""
    from matplotlib.patches import FancyArrowPatch

    angle = np.radians(np.linspace(110.0, 410.0, 60))
    px, pz = x + size * np.cos(angle), z + 0.32 * size * np.sin(angle)
    ax.plot(px, pz, color=BLACK, lw=1.4)
    ax.add_patch(
        FancyArrowPatch(
            (px[-2], pz[-2]),
            (px[-1], pz[-1]),
            arrowstyle="-|>",
            mutation_scale=11.0,
            color=BLACK,
            shrinkA=0.0,
            shrinkB=0.0,
        )
    )


def _charged(part: Part) -> Figure:
    """The charged filament in a vertical electric field, at several strengths."""
    figure = style.new_figure(4.1, 7.4)
    ax = style.axes_at(figure, 0.8, 0.62, 2.96, 6.6)
    offsets = (
        (-5.0, -3.0, "right"),
        (4.0, -8.0, "left"),
        (6.0, -4.0, "left"),
        (6.0, -3.0, "left"),
        (5.0, 4.0, "left"),
        (-5.0, 5.0, "right"),
    )
    for (E, solution), colour, (dx, dy, ha) in zip(part.solutions.items(), RAMP, offsets, strict=False):
        x, _, z = _points(solution, 401).T
        ax.plot(x, z, color=colour, lw=2.4)
        ax.annotate(
            f"{float(E) / 1e3:g}", (x[-1], z[-1]), xytext=(dx, dy), textcoords="offset points", ha=ha, va="center"
        )
    _wall(ax, 0.02, 0.05)
    charge = next(load.charge_per_length for load in solution.problem.loads if hasattr(load, "charge_per_length"))
    words = f"numbers: $E$\nin kV/m\n\ncharge:\n{1e6 * charge:g} \N{MICRO SIGN}C/m"
    ax.annotate(words, (0.098, -0.135), fontsize=10.0, color="#4d4d4d", va="center", linespacing=1.15)
    style.field_arrow(ax, 0.68, 0.47, (0.0, 30.0), r"$\mathbf{E}$", side="left")
    style.field_arrow(ax, 0.80, 0.53, (0.0, -30.0), "$g$")
    ax.set(xlim=(-0.045, 0.185), ylim=(-0.258, 0.258), aspect="equal")
    ax.set_xlabel("$x$ (m)")
    ax.set_ylabel("$z$ (m)", labelpad=0.0)
    return figure


_PAINTERS: dict[str, dict[str, Callable[[Part], Figure]]] = {
    "1-4": {"figure1": _figure1, "figure2": _figure2, "figure3": _figure3, "figure4": _figure4},
    "5": {"figure5": _figure5, "figure5_convergence": _figure5_convergence},
    "6": {"figure6": _figure6},
    "7": {"figure7": _figure7},
    "rotating": {"rotating": _rotating},
    "charged": {"charged": _charged},
}
