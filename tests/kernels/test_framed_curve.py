"""A framed curve from its curvature and twist, against the helix."""

from __future__ import annotations

import numpy as np

from darboux import frames
from darboux.kernels import framed_curve


def test_constant_curvature_and_twist_make_a_helix() -> None:
    """The frame is exp(s [k x]); places by Simpson's rule are good to h^4, and the order is seen."""
    k = np.array([2.0, -1.0, 3.0])
    gaps = []
    for n in (40, 80):
        h, r, q = np.full(2 * n, 0.5 / n), np.empty((n + 1, 3)), np.empty((n + 1, 4))
        framed_curve.lay_out(h, np.tile(k, 2 * n), r.ravel(), q.ravel())
        R = frames.rotation(k)
        np.testing.assert_allclose(frames.matrix_of_quaternion(q[-1]), R, atol=1e-13)
        size = np.linalg.norm(k)
        axis, e3 = k / size, np.array([0.0, 0.0, 1.0])
        along = axis * (axis @ e3)
        place = along + np.sin(size) / size * (e3 - along) + (1.0 - np.cos(size)) / size * np.cross(axis, e3)
        gaps.append(np.linalg.norm(r[-1] - place))
    assert gaps[1] < 1e-7
    assert 3.8 < np.log2(gaps[0] / gaps[1]) < 4.2


def test_turns_follow_one_another() -> None:
    """The frame turns in its own axes: R = exp(k1 / 2) exp(k2 / 2)."""
    k = np.array([[2.0, -1.0, 3.0], [0.5, 1.5, -1.0]])
    r, q = np.empty((2, 3)), np.empty((2, 4))
    framed_curve.lay_out(np.full(2, 0.5), k.ravel(), r.ravel(), q.ravel())
    expected = frames.rotation(0.5 * k[0]) @ frames.rotation(0.5 * k[1])
    np.testing.assert_allclose(frames.matrix_of_quaternion(q[-1]), expected, atol=1e-14)
