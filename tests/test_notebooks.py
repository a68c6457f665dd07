"""How problems and results show themselves in notebooks: plain HTML, whole, short, safe, whatever they hold."""

from __future__ import annotations

import dataclasses
import re
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import darboux as dx
from darboux.view import html
from darboux.view.unloaded import unloaded
from tests.cases import ALONG_X, RUBBER, UNIT

FALLING = dx.Rod(0.25, dx.Circle(1e-3), RUBBER.material, stretch=True)
HANGING = dx.Equilibrium(RUBBER, start=ALONG_X, loads=[dx.Gravity()])
MOTION = dx.Motion(dx.Equilibrium(FALLING, start=ALONG_X, loads=[dx.Gravity()]), 0.1, damping=[dx.MassDamping(2.0)])


@pytest.fixture(scope="module")
def shown() -> dict[str, Any]:
    return {
        "problem": HANGING,
        "ring": dx.Ring(UNIT, link=1),
        "motion": MOTION,
        "solution": dx.solve(HANGING),
        "comparison": dx.compare(HANGING, [dx.Elastica(), dx.DiscreteRod(20)], order=False),
        "trajectory": dx.simulate(MOTION, dx.TRBDF2(10), records=20),
    }


@pytest.mark.parametrize("name", ["problem", "ring", "motion", "solution", "comparison", "trajectory"])
def test_is_a_small_table_and_a_picture(name: str, shown: dict[str, Any]) -> None:
    page = shown[name]._repr_html_()
    root = ElementTree.fromstring(page)  # every tag is closed
    assert len(page.encode()) < 12_000
    assert root.tag == "div"
    tags = {re.sub("{.*}", "", element.tag) for element in root.iter()}
    assert {"svg", "polyline", "table", "td"} <= tags
    assert not tags & {"script", "iframe", "object", "image", "style", "link"}
    assert not re.search(r"javascript:|\son\w+=|url\(|https?://(?!www\.w3\.org)", page)
    assert "currentColor" in page  # words and marks are as the text around them
    assert not re.search(r"(color|fill|stroke)[:=]\"?(#000|#fff|black|white)", page)
    assert "nan" not in page


def test_the_table_says_the_numbers_and_the_picture_is_the_shape(shown: dict[str, Any]) -> None:
    solution = shown["solution"]
    page = solution._repr_html_()
    words = re.sub("<[^>]*>", " ", page)
    for text in (f"{solution.tip[0]:.9g}", "stable", "von Mises", "largest |m|"):
        assert text in words
    (points,) = re.findall('<polyline points="([^"]*)"', page)
    drawn = np.array([point.split(",") for point in points.split()], dtype=float)
    r = solution.r(np.linspace(0.0, 0.25, len(drawn)))[:, [0, 2]] * [1.0, -1.0]
    scale = np.ptp(drawn[:, 1]) / np.ptp(r[:, 1])
    np.testing.assert_allclose(drawn - drawn[0], scale * (r - r[0]), atol=0.11)
    bar = float(re.findall(r"v4h([\d.]+)v-4", page)[0])
    assert "5 cm" in words
    assert bar / scale == pytest.approx(0.05, rel=1e-2)
    page = shown["comparison"]._repr_html_()
    assert shown["comparison"].entries[1].name in page
    assert len(set(re.findall('stroke="(#[0-9a-f]+)"', page))) == 2


def test_the_picture_of_a_motion_shows_each_shape_from_its_start_to_its_end(shown: dict[str, Any]) -> None:
    trajectory = shown["trajectory"]
    lines = re.findall('<polyline points="([^"]*)"', trajectory._repr_html_())
    last = np.array([point.split(",") for point in lines[-1].split()], dtype=float)
    r = trajectory.positions[-1][:, [0, 2]] * [1.0, -1.0]
    assert len(last) == len(r)
    scale = np.ptp(last[:, 0]) / np.ptp(r[:, 0])
    np.testing.assert_allclose(last - last[0], scale * (r - r[0]), atol=0.11)


def test_problems_are_shown_as_they_were_given() -> None:
    words = re.sub("<[^>]*>", " ", MOTION._repr_html_())
    for text in (
        "0.1 s from unloaded",
        "MassDamping(rate=2)",
        "Clamped(tangent=(1, 0, 0))",
        "Circle(radius=0.001)",
        "Gravity()",
    ):
        assert text in words


def test_the_rod_before_anything_acts_on_it() -> None:
    x = np.linspace(0.0, 0.25, 11)
    np.testing.assert_allclose(unloaded(HANGING, x)[0], np.stack([x, 0 * x, 0 * x], axis=1), atol=1e-12)
    pinned = dx.Equilibrium(UNIT, dx.Pinned((0, 0, 1)), dx.Pinned((0, 0.5, 1)))
    np.testing.assert_allclose(
        unloaded(pinned, np.linspace(0.0, 1.0, 5))[0][-1], (0, 1, 1), atol=1e-12
    )  # along the line of its supports
    ring = unloaded(dx.Ring(UNIT), np.linspace(0.0, 1.0, 101))[0]
    np.testing.assert_allclose(ring[0], ring[-1], atol=1e-6)
    np.testing.assert_allclose(np.ptp(ring, axis=0).max(), 1.0 / np.pi, rtol=1e-3)
    helix = dx.Helix(radius=0.02, pitch=0.02)
    spring = dx.Rod(0.5, dx.Circle(1e-3), "steel", natural=helix)
    solution = dx.solve(dx.Equilibrium(spring, start=dx.Clamped(frame=helix.frame())))
    s = np.linspace(0.0, 0.5, 21)
    np.testing.assert_allclose(unloaded(solution.problem, s)[0], solution.r(s), atol=1e-5)


def test_what_is_strange_is_escaped_and_cut(shown: dict[str, Any]) -> None:
    solution = dataclasses.replace(
        shown["solution"], status=dx.Status("<script>alert(1)</script>", "<img src=x onerror=alert(1)>" + 9000 * "&")
    )
    page = solution._repr_html_()
    assert "<script" not in page
    assert "<img" not in page
    assert "&lt;img" in page
    assert len(page) < 12_000
    ElementTree.fromstring(page)
    many = dx.Equilibrium(UNIT, loads=[dx.PointForce((1, 0, 0), at=0.001 * i) for i in range(1, 900)])
    assert len(many._repr_html_()) < 12_000
    assert "and 8" in many._repr_html_()


def test_never_raises(shown: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    trajectory = shown["trajectory"]
    broken = dataclasses.replace(trajectory, positions=np.full_like(trajectory.positions, np.nan))
    assert "<table" in broken._repr_html_()  # the picture is left out, the words stay
    assert "<svg" not in broken._repr_html_()

    class Unspeakable:
        def __repr__(self) -> str:
            raise RuntimeError

    assert html.page(Unspeakable()) == "&lt;Unspeakable&gt;"
    monkeypatch.setattr(html, "_table", lambda *rows: 1 / 0)
    page = shown["solution"]._repr_html_()
    assert page.startswith("<pre>&lt;EquilibriumSolution by Collocation()")
