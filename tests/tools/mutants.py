"""Does some test fail when a formula is wrong? Each mutant flips a sign or drops a term, and names the test that sees it.

    make mutants                     every mutant, some minutes
    make mutants ARGS="band link"    those of files whose path contains one of the words

Each runs in a copy of the tree, kernels uncompiled. The exit status is 1 where a mutant survives, where a named test fails
without it, or where a mutant's text no longer stands in its file exactly once.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("src", "tests", "pyproject.toml", "README.md", "requirements.txt")
LONGEST = 600  # s that one test may take


@dataclass(frozen=True)
class Mutant:
    """In ``file``, below src/darboux, ``text`` becomes ``changed``; then ``test``, below tests, must fail."""

    file: str
    text: str
    changed: str
    test: str

    @property
    def path(self) -> Path:
        return Path("src/darboux") / self.file

    def found(self, root: Path) -> bool:
        """Return whether the text stands in the file exactly once."""
        return (root / self.path).read_text().count(self.text) == 1


ROD_EQUATIONS = "kernels/test_rod_equations.py"
DISCRETE_ROD = "kernels/test_discrete_rod.py"
DERIVATIVE = f"{ROD_EQUATIONS}::test_derivative_is_the_formula"
JACOBIAN = f"{ROD_EQUATIONS}::test_jacobian_is_the_complex_step_of_the_formula"
ORACLE = f"{DISCRETE_ROD}::test_energy_gradient_and_hessian_are_the_oracles"
LAPACK = "kernels/test_band.py::test_definite_band_is_solved_as_by_lapack"
INERTIA = "kernels/test_inertia.py::test_blocks_without_a_pivot_of_their_own_wait"
UNITS = "kernels/test_inertia.py::test_the_units_of_rows_change_no_sign"
PIVOT = "kernels/test_inertia.py::test_a_pivot_is_large_enough_or_the_best"
ONE_STEP = "kernels/test_dormand_prince.py::test_one_step_has_the_declared_order"
MOTION = "kernels/test_rod_motion.py::test_the_band_is_the_derivative_of_the_balance"
RING = "kernels/test_ring.py::test_the_ring_of_a_band_is_solved_as_a_dense_matrix"
EVERY_LOAD = "test_linearisation.py::test_under_every_load"
EVERY_ROD = "test_linearisation.py::test_of_every_rod_under_every_kind_of_load"
LETS_GO = "test_linearisation.py::test_while_another_shape_lets_go"
STATIONS = "test_linearisation.py::test_at_two_stations"
SIGN = "test_linearisation.py::test_the_sign_of_the_determinant_changes_where_a_column_buckles"
TRANSFERS = "test_linearisation.py::test_transfers_carry_the_difference_of_two_steps"
GAUSS = "kernels/test_gauss.py::test_weights_integrate_polynomials"
ELEMENT = "kernels/test_element.py::test_its_rows_are_the_general_elements"
EXPLICIT = "kernels/test_element.py::test_what_is_explicit_is_met"
STAGES = "kernels/test_element.py::test_its_stages_move_as_the_general_elements"
LEAVE_N = "kernels/test_element.py::test_which_loads_leave_n_explicit"
PIVOTS = "kernels/test_element.py::test_equations_without_a_pivot_on_the_diagonal_are_solved"
COLUMN = "kernels/test_path.py::test_a_column_turns_unstable_at_eulers_load"
POWER = "kernels/test_path.py::test_what_goes_with_a_power_of_the_load_is_predicted_exactly"
ORDER = "kernels/test_path.py::test_a_tangent_that_turns_is_predicted_with_order_two"
PREDICTED = "kernels/test_path.py::test_forces_that_go_with_the_load_are_predicted_exactly"
LAST_TANGENT = "kernels/test_path.py::test_the_last_tangent_on_a_better_mesh_is_the_old_ones_interpolation"
NEXT_STEP = "kernels/test_path.py::test_the_next_step_follows_from_what_the_corrector_did"
POSE = "kernels/test_support.py::test_a_pose_goes_the_shortest_way_evenly"
LAID = "kernels/test_mesh.py::test_elements_are_laid_where_they_are_wanted"
SINGULAR = "kernels/test_singular_values.py::test_free_motions_are_left_alone"
LARGE_FORCE = "kernels/test_singular_values.py::test_the_step_of_a_large_force_is_no_free_motion"
SPRING = "test_collocation.py::test_a_rotational_spring_gives_what_its_energy_says"
PIECES = "kernels/test_second_variation.py::test_the_sum_is_the_energy_of_the_pieces"
HELD = "kernels/test_second_variation.py::test_a_held_node_keeps_its_motions_and_forces"
PIECE = "kernels/test_second_variation.py::test_a_piece_is_solved_as_by_numpy"
MERGED = "test_index.py::test_pieces_of_several_elements_count_the_same"
DEFINITE = "kernels/test_second_variation.py::test_a_definite_compliance_is_told_from_others"
ROUGH = "kernels/test_mesh.py::test_roughness_is_the_power_of_h_times_the_next_derivative"
HELIX = "kernels/test_framed_curve.py::test_constant_curvature_and_twist_make_a_helix"
SETTLES = "kernels/test_newton.py::test_the_kernel_takes_the_steps_of_the_rule"
TAUT = "test_cables.py::test_the_tension_of_a_taut_cable_is_as_exact_as_it_says"
WHOLE = "kernels/test_bordered.py::test_both_are_solved_as_a_dense_matrix"
SOUND = "kernels/test_bordered.py::test_borders_are_sound_where_the_matrix_is_singular"
ROWS = "kernels/test_response.py::test_rows_are_the_derivative_of_the_residual"
BY_PARAMETERS = "kernels/test_response.py::test_right_sides_are_the_derivative_of_the_residual"

MUTANTS = (
    Mutant("kernels/algebra.py", "a[2] * b[0] - a[0] * b[2]", "a[0] * b[2] - a[2] * b[0]", DERIVATIVE),
    Mutant("kernels/algebra.py", "return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]", "return a[0] * b[0] + a[1] * b[1]", ORACLE),
    Mutant("kernels/algebra.py", "x[i + 1] * a[0] + x[i + 4] * a[1] + x[i + 7] * a[2]", "x[i + 1] * a[0] + x[i + 4] * a[1] - x[i + 7] * a[2]", DERIVATIVE),
    Mutant("kernels/rod_equations.py", "dm = minus(cross(x.n, dr), l)", "dm = plus(cross(x.n, dr), l)", DERIVATIVE),
    Mutant("kernels/rod_equations.py", "put(dy, j + FORCE * step, step, (-f[0], -f[1], -f[2]))", "put(dy, j + FORCE * step, step, f)", DERIVATIVE),
    Mutant("kernels/rod_equations.py", "v = plus((0.0, 0.0, 1.0), symmetric_times(c, SINV, material_n))", "v = (0.0, 0.0, 1.0)", DERIVATIVE),
    Mutant("kernels/rod_equations.py", "minus(x.v, (0.0, 0.0, 1.0))", "x.v", EVERY_LOAD),
    Mutant("kernels/rod_equations.py", "k = plus(vector(c, K0), symmetric_times(c, BINV, material_m))", "k = symmetric_times(c, BINV, material_m)", DERIVATIVE),
    Mutant("kernels/rod_equations.py", "rotate(x.R, minus(symmetric_times(c, SINV, by_N[1]), by_v[1]))", "rotate(x.R, plus(symmetric_times(c, SINV, by_N[1]), by_v[1]))", JACOBIAN),
    Mutant("kernels/rod_equations.py", "plus(cross(x.n, dr[2]), rotate(x.R, lb[2]))", "plus(cross(x.n, dr[2]), lb[2])", JACOBIAN),
    Mutant("kernels/rod_equations.py", "phi, (k[1], -k[2], 0.0, k[0]))", "phi, (k[1], k[2], 0.0, k[0]))", JACOBIAN),
    Mutant("kernels/rod_equations.py", "(-x, w, z, -y), (-y, -z, w, x)", "(-x, w, z, -y), (-y, z, w, x)", JACOBIAN),
    Mutant("kernels/fours.py", "a[2] + s * b[2], a[3] + s * b[3]", "a[2] + s * b[2], a[3]", JACOBIAN),
    Mutant("kernels/band.py", "lower[target + i] -= scale * lower[column + i]", "lower[target + i] += scale * lower[column + i]", LAPACK),
    Mutant("kernels/band.py", "x0 -= lower[o + i] * x", "x0 += lower[o + i] * x", LAPACK),
    Mutant("kernels/band.py", "x1 = lower[o1 + i] - l10 * x0", "x1 = lower[o1 + i] + l10 * x0", LAPACK),
    Mutant("kernels/band.py", "        if pivot < 0.0:\n            negative += 1\n", "", "kernels/test_band.py::test_indefinite_band_has_as_many_negative_pivots_as_eigenvalues"),
    Mutant("kernels/band.py", "            gradient[j] = 0.0\n", "", "kernels/test_band.py::test_fixed_unknowns_leave_the_system_of_the_free_ones"),
    Mutant("kernels/discrete_rod.py", "moved: Vector = mix(1.0, d, -s, mix(1.0, t, 1.0, new))", "moved: Vector = mix(1.0, d, s, mix(1.0, t, 1.0, new))", f"{DISCRETE_ROD}::test_a_step_moves_the_frames_as_the_oracle_does"),
    Mutant("kernels/discrete_rod.py", "return s * u1 - c * u2, c * u1 + s * u2, twist", "return s * u1 + c * u2, c * u1 + s * u2, twist", f"{DISCRETE_ROD}::test_strains_are_the_oracles"),
    Mutant("kernels/discrete_rod.py", "parts[2] += (0.5 * EA[j - 1] * eps + T[j - 1]) * eps * l[j - 1]", "parts[2] += 0.5 * EA[j - 1] * eps * eps * l[j - 1]", ORACLE),
    Mutant("kernels/discrete_rod.py", "(p, q2, x), (-q1, -p, y)", "(p, q2, -x), (-q1, -p, y)", ORACLE),
    Mutant("kernels/discrete_rod.py", "r, shared = S - 0.5 * psi,", "r, shared = S,", ORACLE),
    Mutant("kernels/discrete_rod.py", "u1, u2 = mix(1.0, u1, -r * phi[0], t)", "u1, u2 = mix(1.0, u1, r * phi[0], t)", ORACLE),
    Mutant("kernels/inertia.py", "return 1 if det < 0.0 else (2 if a < 0.0 else 0)", "return 1 if det < 0.0 else (2 if a > 0.0 else 0)", UNITS),
    Mutant("kernels/inertia.py", "_take_off(F, q, i, (c * x - b * y) * over, q)", "_take_off(F, q, i, (c * x + b * y) * over, q)", INERTIA),
    Mutant("kernels/inertia.py", "abs(c) * x + abs(b) * y, abs(b) * x + abs(a) * y", "abs(a) * x + abs(b) * y, abs(b) * x + abs(c) * y", PIVOT),
    Mutant("kernels/inertia.py", "det = abs(a * c - b * b)", "det = abs(a * c + b * b)", PIVOT),
    Mutant("kernels/inertia.py", "y = beside[3 * j + 2] if beside[3 * j + 1] == i", "y = beside[3 * j + 2] if beside[3 * j + 1] == j", PIVOT),
    Mutant("kernels/inertia.py", "            largest, at, second = size, k, largest\n", "            largest, at = size, k\n", PIVOT),
    Mutant("kernels/inertia.py", "        elif size > second:\n            second = size\n", "", PIVOT),
    Mutant("kernels/inertia.py", "            _look(F, n, partner, beside)\n", "", PIVOT),
    Mutant("kernels/inertia.py", "        for j in range(first, i):\n", "        for j in range(i, i):\n", PIVOT),
    Mutant("kernels/dormand_prince.py", "A41, A42, A43 = 44 / 45, -56 / 15, 32 / 9", "A41, A42, A43 = 44 / 45, 56 / 15, 32 / 9", ONE_STEP),
    Mutant("kernels/dormand_prince.py", "525, -1 / 40\n", "525, 0.0\n", "kernels/test_dormand_prince.py::test_error_and_steps_follow_the_tolerance"),
    Mutant("kernels/dormand_prince.py", "D5, D6, D7 = 701980252875", "D5, D6, D7 = -701980252875", ONE_STEP),
    Mutant("kernels/profile.py", "c[j] = c[j] * x + profile.coefficients[row + j]", "c[j] = c[j] * x - profile.coefficients[row + j]", "kernels/test_dormand_prince.py::test_varying_coefficients_agree_with_scipy"),
    Mutant("kernels/profile.py", "breaks[p + 1] <= s", "breaks[p + 1] < s - 0.1", "kernels/test_dormand_prince.py::test_jump_is_two_integrations_joined"),
    Mutant("kernels/gauss.py", "a = (c[:, None] ** powers / powers) @ np.linalg.inv", "a = (c[:, None] ** powers) @ np.linalg.inv", GAUSS),
    Mutant("kernels/gauss.py", "(j + 1) * stages + l", "(l + 1) * stages + j", STATIONS),
    Mutant("kernels/gauss.py", "(stages + 2 + j) * stages + l", "(stages + 2 + l) * stages + j", STATIONS),
    Mutant("kernels/collocation.py", "g[j + row + a] -= load_factor * shaped[f + a]", "g[j + row + a] += load_factor * shaped[f + a]", EVERY_LOAD),
    Mutant("kernels/collocation.py", "g[j + STATES + row + a] -= shaped[f + a]", "g[j + STATES + row + a] -= load_factor * shaped[f + a]", EVERY_LOAD),
    Mutant("kernels/collocation.py", "before = J[k_ab] if part == 0 else 0.0", "before = 0.0", EVERY_ROD),
    Mutant("kernels/collocation.py", "J[(row + a) * STATES + ROTATION + b] -= load_factor * by_turn[a]", "J[(row + a) * STATES + ROTATION + b] += load_factor * by_turn[a]", EVERY_ROD),
    Mutant("kernels/collocation.py", "write_rate(Y, y, rate, g, j + STATES)", "write_derivative(Y, y, rate, g, j + STATES, 1)", EVERY_LOAD),
    Mutant("kernels/collocation.py", "evaluate(system.rate, piece, place, rate)", "evaluate(table, piece, place, rate)", EVERY_ROD),
    Mutant("kernels/collocation.py", "while piece < table.breaks.size - 2 and table.breaks[piece + 1] <= place:", "while False:", EVERY_ROD),
    Mutant("kernels/collocation.py", "X[x + (a + 1) * width - SIDES] += start[number]", "X[x + (a + 1) * width - SIDES] -= start[number]", EVERY_ROD),
    Mutant("kernels/collocation.py", "coupled, stretches = columns(table) > WIDTH,", "coupled, stretches = False,", EVERY_ROD),
    Mutant("kernels/collocation.py", "sign = -sign if over < 0.0 else sign", "sign = sign", SIGN),
    Mutant("kernels/collocation.py", "(1.0 if k < FREE else -1.0), sides + k", "1.0, sides + k", EVERY_ROD),
    Mutant("kernels/collocation.py", "            station += 1\n", "", STATIONS),
    Mutant("kernels/collocation.py", "one -= factors[f + FREE + k] * delta[there + k * SIDES]", "one += factors[f + FREE + k] * delta[there + k * SIDES]", STATIONS),
    Mutant("kernels/collocation.py", "value = X[x + unknowns] + change * X[x + unknowns + 1]", "value = X[x + unknowns]", EVERY_ROD),
    Mutant("kernels/collocation.py", "last[i * width + j] -= factor * last[k * width + j]", "last[i * width + j] += factor * last[k * width + j]", STATIONS),
    Mutant("kernels/collocation.py", "two -= factors[f + k] * delta[here + k * SIDES + 1]", "two -= factors[f + k] * delta[here + k * SIDES]", STATIONS),
    Mutant("kernels/collocation.py", "V[to + j] -= factor * V[at + j]", "V[to + j] += factor * V[at + j]", STATIONS),
    Mutant("kernels/collocation.py", "rotate(R0, vector(transfer, here))", "rotate(R1, vector(transfer, here))", TRANSFERS),
    Mutant("kernels/collocation.py", "Y_new[q] = Y[q] + part * dq[k]", "Y_new[q] = Y[q] + dq[k]", STAGES),
    Mutant("kernels/element.py", "acts(system.table, FORCE_GRADIENT, DEAD_MOMENT)", "acts(system.table, FORCE_GRADIENT, FOLLOWER_FORCE)", LEAVE_N),
    Mutant("kernels/element.py", "while piece > 0 and breaks[piece] > x:", "while False:", ELEMENT),
    Mutant("kernels/element.py", "breaks[piece + 1] <= x:", "breaks[piece + 1] <= first:", ELEMENT),
    Mutant("kernels/element.py", "evaluate(system.rate, piece, x,", "evaluate(system.table, piece, x,", ELEMENT),
    Mutant("kernels/element.py", "n -= h * weight(s, j, l)", "n += h * weight(s, j, l)", EXPLICIT),
    Mutant("kernels/element.py", "m += h * weight(s, j, l) * at.g[2 * l * STATES + MOMENT + a]", "m += h * weight(s, j, l) * at.g[(2 * l + 1) * STATES + MOMENT + a]", EXPLICIT),
    Mutant("kernels/element.py", "                    value += at.J[J + b] * n\n", "", ELEMENT),
    Mutant("kernels/element.py", "                V[row + 4 * k + a] -= of\n", "                V[row + 4 * k + a] += of\n", ELEMENT),
    Mutant("kernels/element.py", "V[line + C_PHI + b] += sums * at.Q[3 * a + b]", "V[line + C_PHI + b] += sums * at.Q[3 * b + a]", ELEMENT),
    Mutant("kernels/element.py", "V[line + C_SIDE + 1] += h * at.g[(2 * j + 1) * STATES + ROTATION + a]", "V[line + C_SIDE + 1] -= h * at.g[(2 * j + 1) * STATES + ROTATION + a]", ELEMENT),
    Mutant("kernels/element.py", "at.moment[a * LINE + C_M + a] += 1.0", "at.moment[a * LINE + C_M + a] -= 1.0", ELEMENT),
    Mutant("kernels/element.py", "dr = four_plus(dr, -f * J[of + POSITION * STATES + b], dq)", "dr = four_plus(dr, f * J[of + POSITION * STATES + b], dq)", ELEMENT),
    Mutant("kernels/element.py", "            rest -= f\n", "", ELEMENT),
    Mutant("kernels/element.py", "E[(7 + a) * LINE + C_SIDE] += f * at.g[g + MOMENT + a]", "E[(7 + a) * LINE + C_SIDE] -= f * at.g[g + MOMENT + a]", ELEMENT),
    Mutant("kernels/element.py", "T[(N_ + a) * ROW + 2 * FREE + 1] = -rate", "T[(N_ + a) * ROW + 2 * FREE + 1] = rate", ELEMENT),
    Mutant("kernels/element.py", "if abs(V[i * width + k]) > abs(V[pivot * width + k]):", "if False:", PIVOTS),
    Mutant("kernels/element.py", "change * kept[row * LINE + C_SIDE + 1]", "kept[row * LINE + C_SIDE + 1]", STAGES),
    Mutant("kernels/element.py", "kept[row * LINE + k] = -at.V", "kept[row * LINE + k] = at.V", STAGES),
    Mutant("kernels/collocation.py", "transfer[at + row * FREE + k] = T[row * ROW + k]", "transfer[at + k * FREE + row] = T[row * ROW + k]", TRANSFERS),
    Mutant("kernels/support.py", "difference[k] = before[k] - (behind[k] if k >= FORCE else 0.0)", "difference[k] = before[k]", STATIONS),
    Mutant("kernels/support.py", "out[row + FREE + k] = -own[i * ROW + k]", "out[row + FREE + k] = own[i * ROW + k]", STATIONS),
    Mutant("kernels/support.py", "out[(3 + a) * 7] += load_factor * dot(d, A)", "out[(3 + a) * 7] -= load_factor * dot(d, A)", "kernels/test_support.py::test_the_stiffness_is_the_second_derivative_of_the_energy"),
    Mutant("kernels/support.py", "put(out, 18 + count, 6, axis)", "put(out, count, 6, axis)", "kernels/test_support.py::test_free_motions_change_nothing_that_is_held"),
    Mutant("kernels/support.py", "axis = rotate(R, unrotate(R0, axis))", "axis = unrotate(R0, axis)", "kernels/test_support.py::test_free_motions_change_nothing_that_is_held"),
    Mutant("kernels/support.py", "rate[1] * cosine - rate[0] * sine", "rate[1] * cosine + rate[0] * sine", POSE),
    Mutant("kernels/support.py", "rate[2] + way[TWIST]", "rate[2]", POSE),
    Mutant("kernels/support.py", "_along(quaternion(way, FROM_FRAME), load_factor * angle, axis)", "_along(quaternion(way, FROM_FRAME), angle, axis)", POSE),
    Mutant("kernels/second_variation.py", "T[first + 3 + a] -= 0.5 * more[a]", "T[first + 3 + a] += 0.5 * more[a]", PIECES),
    Mutant("kernels/second_variation.py", "            if pivot != k:\n                put_four(M, pivot * LINE + j, here)\n", "", PIECE),
    Mutant("kernels/second_variation.py", "if abs(M[i * LINE + k]) > abs(M[pivot * LINE + k]):", "if False:", PIECE),
    Mutant("kernels/second_variation.py", "T[at + (HALF + a) * BLOCK + k], four(M, k * LINE + INVERSE + j)", "T[at + a * BLOCK + k], four(M, k * LINE + INVERSE + j)", PIECE),
    Mutant("kernels/second_variation.py", "        if again == 0 and _is_definite(work):\n", "        if again == 0:\n", PIECES),
    Mutant("kernels/second_variation.py", "A[j * BLOCK + k] -= A[j * BLOCK + i] * A[k * BLOCK + i]", "A[j * BLOCK + k] += A[j * BLOCK + i] * A[k * BLOCK + i]", DEFINITE),
    Mutant("kernels/second_variation.py", "soft = max(soft, abs(g) / h)", "soft = max(soft, abs(g))", PIECES),
    Mutant("kernels/second_variation.py", "below[at + a * BLOCK + HALF + b] = M[b * LINE + INVERSE + a]", "below[at + a * BLOCK + HALF + b] = M[a * LINE + INVERSE + b]", PIECES),
    Mutant("kernels/second_variation.py", "D[first + k * along] += line[a] * motions[a * HALF + k]", "D[first + k * along] += line[a] * motions[k * HALF + a]", HELD),
    Mutant("kernels/second_variation.py", "for k in range(count, HALF):", "for k in range(HALF, HALF):", HELD),
    Mutant("kernels/mesh.py", "jump /= 0.5 * (h + last)", "jump /= h + last", ROUGH),
    Mutant("kernels/mesh.py", "breaks[next_break] == x[i]", "breaks[next_break] == x[i + 1]", ROUGH),
    Mutant("kernels/mesh.py", "share *= t - c[k]", "share *= t + c[k]", "kernels/test_mesh.py::test_the_polynomials_are_exact_up_to_their_degree"),
    Mutant("kernels/mesh.py", "(1.0 - EVENNESS) * density[i] / total + EVENNESS", "density[i] / total", LAID),
    Mutant("kernels/mesh.py", "measure[piece] + part * (measure[piece + 1] - measure[piece])", "measure[piece + 1]", LAID),
    Mutant("kernels/mesh.py", "            while x[i + 1] > x[i]:\n                i += 1\n", "", "kernels/test_mesh.py::test_a_mesh_that_is_laid_anew_keeps_ends_and_stations"),
    Mutant("kernels/path.py", "if changed and real[GOAL] - real[FACTOR] > shortest:", "if False:", COLUMN),
    Mutant("kernels/path.py", "work.delta[k * SIDES] = share * course.tangent[k]", "work.delta[k * SIDES] = ahead * course.tangent[k]", PREDICTED),
    Mutant("kernels/path.py", "work.delta[k * SIDES] += last_share * course.last_tangent[k]", "work.delta[k * SIDES] -= last_share * course.last_tangent[k]", PREDICTED),
    Mutant("kernels/path.py", "_length(course.last_tangent, elements, part)", "_length(course.last_tangent, elements, 0)", PREDICTED),
    Mutant("kernels/path.py", "    _keep_last_tangent(course)\n", "", PREDICTED),
    Mutant("kernels/path.py", "(b**q - a**q) / q", "(b**q - a**q)", POWER),
    Mutant("kernels/path.py", "np.log(b / a) if abs(q) < 1e-6", "np.log(a / b) if abs(q) < 1e-6", POWER),
    Mutant("kernels/path.py", "here * v * (1.0 + w)", "here * v * (1.0 - w)", POWER),
    Mutant("kernels/path.py", "-here * v * w / before**p", "-here * v * w", POWER),
    Mutant("kernels/path.py", "here = real[FACTOR] + real[FIRST]", "here = real[FACTOR]", POWER),
    Mutant("kernels/path.py", "w = 0.5 * v / _span(p, before, 1.0)", "w = v / _span(p, before, 1.0)", ORDER),
    Mutant("kernels/path.py", "np.log(last_length / length) / np.log(before)", "0.0 * np.log(before)", ORDER),
    Mutant("kernels/path.py", "part = (new[k] - old[i]) / (old[i + 1] - old[i])", "part = (new[k] - old[i]) / (1.0 - old[i])", LAST_TANGENT),
    Mutant("kernels/path.py", "            i, part = i + 1, 1.0\n", "            i, part = i + 1, 0.0\n", LAST_TANGENT),
    Mutant("kernels/path.py", "rod.unseen, 2 if np.isfinite(real[LAST]) else 1", "rod.unseen, 1 if np.isfinite(real[LAST]) else 2", NEXT_STEP),
    Mutant("kernels/mesh.py", "else own[element] / h)", "else 0.0)", "kernels/test_mesh.py::test_roughness_is_the_power_of_h_times_the_next_derivative"),
    Mutant("kernels/stability.py", "(1.0 if a == b else 0.0)) / unit", "(1.0 if a == b else 0.0)) * unit", MERGED),
    Mutant("kernels/stability.py", "if not apart < SHORT:", "if not apart < 1e3 * SHORT:", MERGED),
    Mutant("kernels/stability.py", "line, transfer[at + row * BLOCK + k], four(transfer, last + k * BLOCK + j)", "line, transfer[last + row * BLOCK + k], four(transfer, at + k * BLOCK + j)", MERGED),
    Mutant("kernels/stability.py", "if i > 0 and system.x[i] > system.x[i - 1]:", "if i > 0:", MERGED),
    Mutant("kernels/stability.py", "lent[9 * piece + 3 * a + b] += compliance", "lent[9 * piece + 3 * a + b] -= compliance", MERGED),
    Mutant("kernels/stability.py", "foundation, of_forces)", "foundation, of_forces - 1)", COLUMN),
    Mutant("kernels/step_control.py", "WANTED_SHARE * predicted / corrected", "predicted / corrected", "kernels/test_path.py::test_the_corrector_would_turn_the_rod_as_wanted"),
    Mutant("kernels/step_control.py", "max(LARGEST_SHARE * predicted, unseen)", "LARGEST_SHARE * predicted", "kernels/test_path.py::test_the_corrector_may_turn_the_rod_by_a_share_of_what_was_predicted"),
    Mutant("kernels/step_control.py", "(WANTED_CORRECTED_TURN / corrected) ** (1.0 / (order + 1))", "(WANTED_CORRECTED_TURN / corrected) ** (1.0 / order)", "kernels/test_path.py::test_the_corrector_would_turn_the_rod_as_wanted"),
    Mutant("kernels/singular_values.py", "max(FREE_MOTION, unsure)", "FREE_MOTION", "kernels/test_singular_values.py::test_what_is_unsure_makes_a_motion_free_that_rounding_would_not"),
    Mutant("kernels/singular_values.py", "sine * x + cosine * y", "sine * x - cosine * y", SINGULAR),
    Mutant("kernels/singular_values.py", "last[row * WIDTH + k] *= unit[k]", "last[row * WIDTH + k] *= 1.0", LARGE_FORCE),
    Mutant("kernels/singular_values.py", "+= unit[k] * V[k * SIZE + j] * wanted", "+= V[k * SIZE + j] * wanted", LARGE_FORCE),
    Mutant("kernels/singular_values.py", "if idle and size[j] <= max(FREE_MOTION, unsure) * largest:", "if idle:", "kernels/test_singular_values.py::test_a_small_wish_along_a_motion_that_resists_is_granted"),
    Mutant("kernels/singular_values.py", "idle = abs(wanted) <= IDLE * np.sqrt(norm[side]) + max(NOISE, unsure)", "idle = True", "kernels/test_singular_values.py::test_what_is_asked_for_along_a_free_motion_is_done"),
    Mutant("kernels/framed_curve.py", "w * g - a * j + b * e + c * f", "w * g + a * j + b * e - c * f", "kernels/test_framed_curve.py::test_turns_follow_one_another"),
    Mutant("kernels/framed_curve.py", "scaled(4.0, middle)", "scaled(3.0, middle)", HELIX),
    Mutant("kernels/newton.py", "= sign * np.sign(pivot), 0.0", "= sign, 0.0", SIGN),
    Mutant("kernels/newton.py", "length > max(0.5 * last, 10.0 * tolerance, floor)", "length > max(2.0 * last, 10.0 * tolerance, floor)", SETTLES),
    Mutant("kernels/newton.py", "(length / last) ** 2 if np.isfinite(last)", "(length / last) ** 3 if np.isfinite(last)", SETTLES),
    Mutant("kernels/newton.py", "unit[N_:M_], unit[M_:] = of_state[FORCE], of_state[MOMENT]", "pass", TAUT),
    Mutant("kernels/newton.py", "kept[TURNED] += kept[TURN]", "kept[TURNED] = kept[TURN]", SETTLES),
    Mutant("kernels/newton.py", "foreseen = min(UNSURE * length,", "foreseen = min(0.0 * length,", SETTLES),
    Mutant("kernels/support.py", "z = a * h - d * e - b * g + c * f", "z = a * h + d * e - b * g + c * f", SPRING),
    Mutant("kernels/support.py", "plus(moment, scaled(0.5, first))", "plus(moment, scaled(-0.5, first))", SPRING),
    Mutant("kernels/rod_motion.py", "    add(residual, 4 * j - 4, scaled(-s, e))\n", "    add(residual, 4 * j - 4, scaled(s, e))\n", MOTION),
    Mutant("kernels/rod_motion.py", "add_tension_hessian(scaled(1.0 / size, e), s, stiff / l - s, j, lower)", "add_tension_hessian(scaled(1.0 / size, e), s, stiff / l, j, lower)", MOTION),
    Mutant("kernels/rod_motion.py", "(drag.size // 4), l.size - closing.size // 2", "(drag.size // 4), l.size", "kernels/test_ring.py::test_drag_acts_on_every_edge_once"),
    Mutant("kernels/rod_motion.py", "vector(row, fluids + 3 * k)", "vector(row, fluids)", "test_motion.py::test_every_drag_has_its_own_fluid"),
    Mutant("kernels/rod_motion.py", "            correction[correction.size - 1] = KEPT\n", "            pass\n", "test_motion.py::test_steps_do_not_stall_where_a_spring_is_almost_still"),
    Mutant("kernels/rod_motion.py", "    moved = body.inextensible\n", "    moved = False\n", "test_motion.py::test_the_first_step_of_a_shaken_rod_that_does_not_stretch_has_its_work"),
    Mutant("kernels/ring.py", "border[row + q] -= l * border[o + q]", "border[row + q] += l * border[o + q]", RING),
    Mutant("kernels/ring.py", "corner[row + q] -= z * border[o + q] + z1", "corner[row + q] -= z * border[o + q] - z1", RING),
    Mutant("kernels/ring.py", "            corner[LANES * p + q] += entry(lower, last + p, q) + entry(lower, last + q, p)\n", "", RING),
    Mutant("kernels/ring.py", "mix(turn[0], director, turn[1], cross(tangent, director))", "mix(turn[0], director, -turn[1], cross(tangent, director))", "kernels/test_ring.py::test_the_repeated_edge_has_the_first_ones_frame_turned"),
    Mutant("kernels/ring.py", "-(residual[p] + residual[last + p])", "-(residual[p])", "kernels/test_ring.py::test_what_stands_twice_is_accelerated_by_the_force_on_both"),
    Mutant("dynamics/closing.py", "V[0] * k0[0] @ Q", "V[0] * k0[0] @ Q.T", "kernels/test_ring.py::test_the_cell_at_the_closing_has_one_frame"),
    Mutant("dynamics/closing.py", "holonomy - np.rint(writhe_of_polygon(r) - holonomy)", "holonomy", "test_ring_motion.py::test_a_given_shape_gets_the_twist_that_its_link_leaves"),
    Mutant("kernels/rod_motion.py", "lower[LOWER * k] += rate * slowness * mass[k]", "lower[LOWER * k] -= rate * slowness * mass[k]", MOTION),
    Mutant("kernels/rod_motion.py", "lower[LOWER * (4 * i + p)] += m * rate * rate", "lower[LOWER * (4 * i + p)] += m * rate", MOTION),
    Mutant("kernels/rod_motion.py", "lower[LOWER * (o - 4 + p) + 4] -= s\n", "lower[LOWER * (o - 4 + p) + 4] += s\n", MOTION),
    Mutant("kernels/rod_motion.py", "c = (dot(Bmean, minus(after, before)) - dot(mu, dk)) / size", "c = 0.0 * size", "kernels/test_rod_motion.py::test_the_work_of_a_step_is_the_change_of_energy"),
    Mutant("kernels/rod_motion.py", "scaled(level[k] - dot(a, vector(old.x, 3 * i))", "scaled(-level[k] - dot(a, vector(old.x, 3 * i))", "kernels/test_rod_motion.py::test_what_is_held_along_a_line_stays_on_it"),
    Mutant("link.py", "triple = -_dot(a, across)", "triple = _dot(a, across)", "validation/test_geometry.py::test_polygons"),
    Mutant("link.py", "half_angles = np.triu(one + two, 2)", "half_angles = np.triu(one, 2)", "validation/test_geometry.py::test_polygons"),
    Mutant("kernels/support.py", "cross(phi, vector(UNIT, 3 - i))", "cross(vector(UNIT, 3 - i), phi)", "test_offsets.py::test_the_derivatives_of_the_end_conditions"),
    Mutant("kernels/rod_motion.py", "mix(1.0, second, dot(m, psi), u)", "mix(1.0, second, -dot(m, psi), u)", MOTION),
    Mutant("kernels/rod_motion.py", "first = plus(change, of_turned(G, symmetric_times(compliance, o, change)))", "first = change", MOTION),
    Mutant("statics/discrete_chain.py", "- G.T @ cross_matrix(u)", "+ G.T @ cross_matrix(u)", "test_offsets.py::test_the_hessian_of_the_chain_is_the_derivative_of_its_gradient"),
    Mutant("statics/discrete_chain.py", "np.trace(G) + 0.5 * m @ self.c @ m", "np.trace(G) - 0.5 * m @ self.c @ m", "test_offsets.py::test_the_hessian_of_the_chain_is_the_derivative_of_its_gradient"),
    Mutant("loads.py", "total.a -= C @ np.array(self.point)", "total.a += C @ np.array(self.point)", "test_descriptions.py::test_loads_are_affine_in_position_and_frame"),
    Mutant("kernels/bordered.py", "add_multiple(V, at, -V[row * width + j], V, of, width - j - 1)", "add_multiple(V, at, -V[row * width + j], V, of, FREE - j - 1)", WHOLE),
    Mutant("kernels/bordered.py", "-factors.reduced[(i * rows + row) * FREE + j], v, row * sides, sides)", "factors.reduced[(i * rows + row) * FREE + j], v, row * sides, sides)", WHOLE),
    Mutant("kernels/bordered.py", "        if V[j * width + j] < 0.0:\n            sign = -sign\n", "", WHOLE),
    Mutant("kernels/bordered.py", "x[order[j] * sides + side] = y[j * sides + side] / factors.sizes[order[j]]", "x[order[j] * sides + side] = y[j * sides + side]", WHOLE),
    Mutant("kernels/bordered.py", "            V[to + FREE : to + 2 * FREE] = borders.rows[there : there + FREE]\n", "            pass\n", SOUND),
    Mutant("kernels/bordered.py", "A[at + FREE : at + own] = borders.columns[border : border + k]", "A[at + FREE : at + own] = 0.0", SOUND),
    Mutant("kernels/bordered.py", "if abs(A[row * n + a]) > least:", "if abs(A[row * n + a]) > least and a == j and row == j:", SOUND),
    Mutant("kernels/response.py", "= h * weight(plan.stages, j, l)", "= weight(plan.stages, j, l)", BY_PARAMETERS),
    Mutant("kernels/response.py", "dg[l * STATES + a] += by_width * plan.g[l * SIDES * STATES + a]", "dg[l * STATES + a] += 0.0 * by_width", BY_PARAMETERS),
    Mutant("kernels/response.py", "-= system.load_factor * rates.shaped[(at + l) * LOADS + a]", "+= system.load_factor * rates.shaped[(at + l) * LOADS + a]", BY_PARAMETERS),
    Mutant("kernels/response.py", "shifted[a] = support[a] + by * du[a]", "shifted[a] = support[a]", BY_PARAMETERS),
    Mutant("kernels/response.py", "        y[k] -= system.y[(i + 1) * STATES + k]\n", "        pass\n", ROWS),
    Mutant("kernels/response.py", "matrix.blocks[block + FREE + row] = -1.0", "matrix.blocks[block + FREE + row] = 1.0", ROWS),
    Mutant("kernels/response.py", "    _sharpen(support, y, load_factor, own)\n    for row", "    for row", ROWS),
    Mutant("statics/rates.py", "np.concatenate([[0.0], moved, [1.0]])", "np.concatenate([[0.0], breaks, [1.0]])", "kernels/test_response.py::test_the_mesh_stretches_with_its_breaks"),
    Mutant("statics/rates.py", "dy += by.unit[:, None] * mesh.y + by.origin[:, None]", "dy += by.origin[:, None]", "kernels/test_response.py::test_tangents_are_the_derivative_of_the_solution"),
    Mutant("statics/linearised.py", "found.solve(unit), found.solve_transposed(unit)", "found.solve(unit), found.solve(unit)", "test_linearised.py::test_at_a_fold_borders_are_sound_and_plain_solves_are_not"),
)  # fmt: skip


def main(words: list[str]) -> int:
    """Run the mutants whose file contains one of the words, or all; return 1 where one survives or is out of date."""
    mutants = [mutant for mutant in MUTANTS if not words or any(word in mutant.file for word in words)]
    lost = [mutant for mutant in mutants if not mutant.found(ROOT)]
    for mutant in lost:
        print(f"no longer in {mutant.path}, or there more than once: {mutant.text!r}")
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Path(folder)
        for name in COPIED:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy2(source, copy / name)
        sound = {test: _passes(copy, test) for test in sorted({mutant.test for mutant in mutants})}
        print(f"{sum(sound.values())} of {len(sound)} tests pass without a mutant.", flush=True)
        for test in (test for test, passes in sound.items() if not passes):
            print(f"fails without a mutant: {test}")
        survivors = [mutant for mutant in mutants if mutant not in lost and not _killed(copy, mutant)]
    print(f"{len(mutants) - len(lost) - len(survivors)} of {len(mutants)} mutants are seen.")
    return int(bool(lost or survivors or not all(sound.values())))


def _killed(copy: Path, mutant: Mutant) -> bool:
    """Return whether the named test fails with the mutant, and say so."""
    path, began = copy / mutant.path, time.perf_counter()
    original = path.read_text()
    path.write_text(original.replace(mutant.text, mutant.changed))
    try:
        survived = _passes(copy, mutant.test)
    finally:
        path.write_text(original)
    verdict = "SURVIVED" if survived else "seen"
    print(
        f"{verdict:9}{time.perf_counter() - began:6.1f} s  {mutant.file}: {mutant.text.strip()!r}  by {mutant.test}",
        flush=True,
    )
    return not survived


def _passes(copy: Path, test: str) -> bool:
    """Return whether the test passes in the copy. Raises where it did not run at all."""
    variables = {"PYTHONPATH": os.pathsep.join([str(copy / "src"), str(copy)]), "NUMBA_DISABLE_JIT": "1", "MPLBACKEND": "Agg", "PYTHONDONTWRITEBYTECODE": "1"}  # fmt: skip
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", f"tests/{test}"]
    try:
        done = subprocess.run(
            command, cwd=copy, env=os.environ | variables, capture_output=True, text=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        return False  # a mutant that never ends is seen
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{test} did not run:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.returncode == 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
