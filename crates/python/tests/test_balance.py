"""The balance of one frequency, for solvers of others."""

import struct

import numpy as np
import pytest

import dovetail
from dovetail import Problem
from conftest import DATA

HZ = 690.0


def of_library(balance):
    """U and v of the example `own_newton` of the library."""
    v = (np.arange(balance.unknowns) * 7919 % 2003) / 1e9 - 1e-6
    return balance.at_rest + v, v


def test_residual_and_jacobian_have_the_bits_of_the_library(problem, example):
    balance = problem.balance(HZ, 1, 64)
    u, v = of_library(balance)
    bits = [line.split() for line in example("own_newton", "--bits").splitlines()]
    residual, product = (
        np.array([struct.unpack(">d", bytes.fromhex(row[i]))[0] for row in bits]) for i in (0, 1)
    )
    assert len(residual) == balance.unknowns == 3 * 3 * 72
    np.testing.assert_array_equal(balance.residual(u), residual)
    np.testing.assert_array_equal(balance.jacobian_times(u, v), product)
    assert np.ptp(residual) > 0 and np.ptp(product) > 0


def test_the_residual_is_that_of_the_equations(problem):
    """Lambda U + lambda - F, with Lambda from the matrices of the problem."""
    balance = problem.balance(HZ, 3, 64)
    u, _ = of_library(balance)
    stiffness, mass = problem.stiffness_n_m, problem.mass_kg
    blocks = u.reshape(7, -1)
    own = balance.stiffness_times(u).reshape(7, -1)
    np.testing.assert_allclose(own[0], stiffness @ blocks[0], rtol=1e-9, atol=1e-9 * abs(own[0]).max())
    # Condensed on the pairs: K (1 + i w a) - w^2 (M + p (..)^-1 p^T).
    a = 2 * 0.001 / (2 * np.pi * problem.static_state().linear_frequency_hz[0])
    for k in (1, 2, 3):
        w = k * 2 * np.pi * HZ
        s = 1 + 1j * w * a
        modal = w**4 / (s * problem.omega2 - w**2)
        condensed = s * stiffness - w**2 * mass - (problem.coupling * modal) @ problem.coupling.T
        x = blocks[2 * k - 1] - 1j * blocks[2 * k]
        found = own[2 * k - 1] - 1j * own[2 * k]
        expected = condensed @ x
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-9 * abs(expected).max())
    whole = balance.stiffness_times(u) + balance.contact_force_n(u) - balance.force_n
    np.testing.assert_allclose(balance.residual(u), whole, atol=1e-9 * abs(whole).max())


def test_the_jacobian_is_the_derivative_of_the_residual(problem):
    balance = problem.balance(HZ, 1, 64)
    u, v = of_library(balance)
    jacobian = balance.jacobian(u)
    np.testing.assert_allclose(jacobian @ v, balance.jacobian_times(u, v), rtol=1e-9, atol=1e-6)
    step = 1e-5
    along = (balance.residual(u + step * v) - balance.residual(u - step * v)) / (2 * step)
    product = balance.jacobian_times(u, v)
    assert np.linalg.norm(along - product) < 1e-3 * np.linalg.norm(product)
    # The contact answers: it is not the dynamic stiffness alone.
    assert np.linalg.norm(balance.stiffness_times(v) - product) > 0.1 * np.linalg.norm(product)


def test_newtons_method_in_numpy_finds_the_motion_of_the_library(problem):
    balance = problem.balance(HZ, 1, 64)
    u = balance.at_rest
    for _ in range(10):
        u = u - np.linalg.solve(balance.jacobian(u), balance.residual(u))
    own = balance.motion(u)
    found = problem.response([HZ], harmonics=1, samples=64, progress=False)[0]
    assert own.residual < 1e-9
    np.testing.assert_allclose(own.amplitude_m, found.amplitude_m, rtol=1e-7)
    np.testing.assert_allclose(own.friction_power_w, found.friction_power_w, rtol=1e-5)
    assert own.status == found.status


def test_the_motion_of_a_run_solves_its_balance(run):
    """eps is taken in the middle of the range, and the mean is retained where the run does so."""
    for motion in (run.response[0], run.response[2]):
        balance = run.problem.balance(
            motion.frequency_hz, 3, 128, eps_hz=700.0, retained=motion.retention_n > 0
        )
        residual, load = balance.residual(motion.u), balance.force_n
        assert np.linalg.norm(residual) < 1e-7 * np.linalg.norm(load)
        assert balance.motion(motion.u).retention_n == pytest.approx(motion.retention_n, rel=1e-6)


def test_the_spring_of_a_retention_is_in_the_residual():
    problem = Problem.from_folder(DATA, friction=0.05, force_n=5.0, damping={"ratio": 0.001})
    free, held = (problem.balance(HZ, 1, 64, retained=retained) for retained in (False, True))
    u, _ = of_library(free)
    assert np.linalg.norm(free.residual(u) - held.residual(u)) > 1e-6 * np.linalg.norm(free.residual(u))


def test_shapes_of_a_balance(problem):
    balance = problem.balance(HZ, 2, 32, eps="pair", eps_scale=2.0)
    assert balance.shape == (5, 72, 3) and balance.unknowns == 5 * 72 * 3
    assert (balance.frequency_hz, balance.harmonics) == (HZ, 2)
    assert balance.eps.shape == (216,)
    np.testing.assert_allclose(balance.eps[::3], 2 * problem.stiffness_n_m.diagonal()[::3])
    at_rest = balance.at_rest.reshape(balance.shape)
    np.testing.assert_array_equal(at_rest[0], problem.static_state().relative_displacement_m)
    assert not at_rest[1:].any()


@pytest.mark.parametrize(
    ("error", "words", "change"),
    [
        (ValueError, r"u has the shape \(647,\), .* \(648,\)", lambda u: u[:-1]),
        (ValueError, r"u has the shape \(3, 216\)", lambda u: u.reshape(3, 216)),
        (TypeError, "u is complex", lambda u: u + 0j),
        (TypeError, "float32", lambda u: u.astype(np.float32)),
        (TypeError, "double precision", lambda u: u.astype(np.longdouble)),
        (TypeError, "numbers", lambda u: list(map(str, u))),
        (TypeError, "numbers", lambda u: u > 0),
        (TypeError, "numbers", lambda u: None),
        (ValueError, "not finite: NaN at entry 5", lambda u: np.where(np.arange(648) == 5, np.nan, u)),
        (ValueError, "not finite: inf at entry 0", lambda u: np.where(np.arange(648) == 0, np.inf, u)),
    ],
)
def test_what_is_no_motion_is_refused_with_the_reason(problem, error, words, change):
    balance = problem.balance(HZ, 1, 64)
    wrong = change(balance.at_rest)
    for ask in (balance.residual, balance.motion, balance.jacobian, balance.stiffness_times):
        with pytest.raises(error, match=words.replace("u ", "[uv] ")):
            ask(wrong)
    with pytest.raises(error, match=words.replace("u ", "v ")):
        balance.jacobian_times(balance.at_rest, wrong)


def test_whole_numbers_strides_and_lists_are_taken(problem):
    balance = problem.balance(HZ, 1, 64)
    twice = np.zeros(2 * balance.unknowns)
    twice[::2] = balance.at_rest
    expected = balance.residual(balance.at_rest)
    np.testing.assert_array_equal(balance.residual(twice[::2]), expected)
    np.testing.assert_array_equal(balance.residual(list(balance.at_rest)), expected)
    zeros = np.zeros(balance.unknowns)
    np.testing.assert_array_equal(
        balance.residual(zeros.astype(int)), balance.residual(zeros)
    )


@pytest.mark.parametrize(
    ("words", "change"),
    [
        ("above 0", {"frequency_hz": 0.0}),
        ("above 0", {"frequency_hz": np.nan}),
        ("1 to 1000", {"harmonics": 0}),
        ("1 to 1000", {"harmonics": 1001}),
        ("with 3 harmonics it must be 16", {"samples": 15}),
        ("choices", {"eps": "none"}),
    ],
)
def test_a_balance_that_is_none_is_refused_with_the_reason(problem, words, change):
    given = {"frequency_hz": HZ, "harmonics": 3} | change
    with pytest.raises(ValueError, match=words):
        problem.balance(given.pop("frequency_hz"), given.pop("harmonics"), **given)


def test_a_jacobian_too_large_for_a_matrix_names_the_other_way(problem):
    balance = problem.balance(HZ, 40, 256)
    assert balance.unknowns == 17496
    with pytest.raises(ValueError, match="jacobian_times"):
        balance.jacobian(balance.at_rest)


def test_a_problem_without_a_static_state_has_no_balance():
    problem = Problem.from_reduced(
        np.diag([0.0, 1.0, 1.0]), np.eye(3), np.zeros((3, 0)), [],
        static_load=([1.0, 0.0, 0.0], []), excitation=([1.0, 0.0, 0.0], []), observe={},
        friction=0.3,
    )
    with pytest.raises(dovetail.RunError, match="static state"):
        problem.balance(0.1, 1)
