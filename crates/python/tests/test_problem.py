"""Reduced models: from matrices, from arrays and from folders, against closed forms."""

import numpy as np
import pytest

import dovetail
from dovetail import Pair, Problem
from conftest import DATA

sparse = pytest.importorskip("scipy.sparse")


def mass_on_friction(friction):
    """A mass of 1 kg on a spring of 1 N/m, pressed on the ground with 1 N and shaken with 1 N."""
    return Problem.from_reduced(
        np.eye(3), np.eye(3), np.zeros((3, 0)), [],
        static_load=([-1, 0, 0], []), excitation=([0, 1, 0], []),
        observe={"mass": ([0, 1, 0], [])}, friction=friction,
    )


def den_hartog_m(friction, ratio):
    """Amplitude of the motion without stops in closed form (Den Hartog 1931), m."""
    angle = np.pi / ratio
    lost = friction * np.sin(angle) / (ratio * (1 + np.cos(angle)))
    return np.hypot(1 / (1 - ratio**2), 0) * np.sqrt(1 - (lost * (1 - ratio**2)) ** 2)


def test_a_mass_on_friction_approaches_the_closed_form():
    exact, hz = den_hartog_m(0.2, 0.7), 0.7 / (2 * np.pi)
    problem = mass_on_friction(0.2)
    found = [
        problem.response([hz], harmonics=h, samples=512, progress=False).amplitude_m[0, 0]
        for h in (9, 31)
    ]
    few, many = np.array(found) / exact - 1
    assert abs(many) < 0.4 * abs(few) and abs(many) < 0.01


def test_matrices_give_the_jenkins_oscillator_of_the_example(example):
    stiffness, mass = [[1.5, -0.5], [-0.5, 0.5]], np.diag([1.0, 0.0])
    pair = Pair((None, 1, None), friction=0.2, preload_n=1.0)
    problem = Problem.from_matrices(
        np.array(stiffness), mass, [pair], excitation=[0.25, 0.0], observe={"mass": 0},
        damping={"mass_per_s": 0.02}, modes=1, highest_hz=1.05 / (2 * np.pi),
    )
    printed = {line.split()[3]: float(line.split()[0]) for line in example("reduced_from_matrices").splitlines()}
    for harmonics in ("1", "3", "15"):
        response = problem.response(
            [1.05 / (2 * np.pi)], harmonics=int(harmonics), samples=8192, eps="pair", eps_scale=1.5,
            progress=False,
        )
        assert response.amplitude_m[0, 0] == pytest.approx(printed[harmonics], abs=2e-6)


def two_masses(against, **options):
    """Two masses, each on a spring to the ground, with a contact between them along the motion."""
    stiffness, mass = np.diag([4.0, 9.0]), np.diag([1.0, 1.5])
    pair = Pair((None, 0, None), against=against, friction=0.5, preload_n=1e6, **options)
    return Problem.from_matrices(
        stiffness, mass, [pair], excitation=[1.0, 0.0], observe={"first": 0, "second": [0.0, 1.0]},
        damping={"mass_per_s": 0.05},
    )


def test_a_pair_that_sticks_joins_two_masses():
    problem = two_masses(against=(None, 1, None))
    stuck = np.sqrt((4 + 9) / 2.5) / (2 * np.pi)
    np.testing.assert_allclose(problem.stuck_frequency_hz, [stuck])
    hz = 0.9 * stuck
    omega = 2 * np.pi * hz
    expected = 1 / abs(13 - 2.5 * omega**2 + 0.05j * 2.5 * omega)
    response = problem.response([hz], harmonics=1, progress=False)
    np.testing.assert_allclose(response.amplitude_m, [[expected, expected]], rtol=1e-9)
    # A force of phase 0 and the motion behind it.
    lag = -np.angle(response.observed_m("second")[0, 1])
    assert lag == pytest.approx(np.arctan2(0.05 * 2.5 * omega, 13 - 2.5 * omega**2), rel=1e-6)


def test_springs_between_two_masses_are_those_of_the_pair():
    """Far below the limit of friction the contact is a linear spring between the masses."""
    problem = two_masses((None, 1, None), normal_stiffness_n_m=1e9, tangential_stiffness_n_m=3.0)
    hz = 0.2
    omega = 2 * np.pi * hz
    dynamic = np.array([[7.0, -3.0], [-3.0, 12.0]]) + np.diag([1, 1.5]) * (0.05j * omega - omega**2)
    expected = np.linalg.solve(dynamic, [1, 0])
    response = problem.response([hz], harmonics=3, progress=False)
    found = [response.observed_m(name)[0, 1] for name in ("first", "second")]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_the_order_of_degrees_of_freedom_and_the_frame_do_not_matter():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(9, 9))
    stiffness, mass = root @ root.T + 9 * np.eye(9), np.diag(rng.uniform(1, 2, 9))
    force, steady = rng.normal(size=9), np.zeros(9)
    steady[6:] = [-3.0, 0.1, 0.2]

    def response(stiffness, mass, force, steady, pair, observed):
        problem = Problem.from_matrices(
            stiffness, mass, [pair], excitation=0.5 * force, observe={"point": observed},
            static_load=steady, damping={"ratio": 0.01}, modes=9,
        )
        hz = 0.8 * problem.stuck_frequency_hz[0]
        return problem.response([hz], harmonics=3, progress=False)

    plain = response(stiffness, mass, force, steady, Pair((6, 7, 8), friction=0.3), 0)
    assert plain[0].status == ["slipping"] or plain[0].status == ["opening"]
    order = rng.permutation(9)
    place = list(np.argsort(order))
    mixed = response(
        stiffness[np.ix_(order, order)], sparse.csr_array(mass[np.ix_(order, order)]), force[order],
        steady[order], Pair(tuple(place[6:]), friction=0.3), place[0],
    )
    np.testing.assert_allclose(mixed.amplitude_m, plain.amplitude_m, rtol=1e-8)
    # The same in axes of space: x = turn^T (n, t1, t2), where the rows of the frame are n, t1, t2.
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    whole = np.eye(9)
    whole[6:, 6:] = turn.T
    turned = response(
        whole @ stiffness @ whole.T, whole @ mass @ whole.T, whole @ force, whole @ steady,
        Pair((6, 7, 8), friction=0.3, frame=turn), 0,
    )
    np.testing.assert_allclose(turned.amplitude_m, plain.amplitude_m, rtol=1e-8)


def test_a_beam_from_sparse_matrices_has_its_frequencies(beam):
    stiffness, mass = beam
    size = len(stiffness)
    force = np.zeros(size)
    force[-2] = 1.0
    pair = Pair(
        (None, size - 2, None), friction=0.3, preload_n=10.0, normal_stiffness_n_m=1e6,
        tangential_stiffness_n_m=1e3,
    )
    problem = Problem.from_matrices(
        sparse.csr_matrix(stiffness), sparse.coo_matrix(mass), [pair], excitation=force,
        observe={"tip": size - 2}, fixed=[0, 1], damping={"ratio": 0.005}, highest_hz=50,
    )
    # Cantilever with a spring at its tip, from the same matrices.
    from scipy.linalg import eigh

    k, m = stiffness[2:, 2:].copy(), mass[2:, 2:]
    k[-2, -2] += 1e3
    expected = np.sqrt(eigh(k, m, eigvals_only=True)[:3]) / (2 * np.pi)
    state = problem.static_state()
    assert state.status == ["stuck"]
    # The preload is that of the contact, although the beam has no normal direction.
    np.testing.assert_allclose(state.contact_force_n[0], [-10, 0, 0], rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(state.linear_frequency_hz[:3], expected, rtol=2e-5)
    small, large = (
        problem.with_excitation_times(factor)
        .response([0.5 * expected[0], 1.1 * expected[0]], harmonics=5, follow=True, progress=False)
        .peak()
        for factor in (0.01, 1.0)
    )
    # A small force lets the pair stick, and a large one lets it slide: the beam becomes softer.
    assert small.frequency_hz == pytest.approx(expected[0], rel=1e-3)
    assert large.frequency_hz < 0.95 * small.frequency_hz
    assert large.amplitude_m < 100 * small.amplitude_m


def test_a_folder_gives_the_response_of_its_scene(run, problem):
    response = problem.response(
        np.linspace(695, 705, 5), harmonics=3, samples=128, progress=False
    )
    np.testing.assert_array_equal(response.amplitude_m, run.response.amplitude_m)
    np.testing.assert_array_equal(
        problem.static_state().contact_force_n, run.static_state.contact_force_n
    )
    of_run = run.problem.response(
        np.linspace(695, 705, 5), harmonics=3, samples=128, progress=False
    )
    np.testing.assert_array_equal(of_run.amplitude_m, run.response.amplitude_m)


def test_arrays_of_a_problem_make_the_same_problem(problem):
    names = ("excitations", "excitations_on_modes", "observed_points", "observed_points_on_modes")
    folder = {name: read_array(DATA / f"{name}.mtx") for name in names}
    again = Problem.from_reduced(
        problem.stiffness_n_m, problem.mass_kg, problem.coupling, problem.omega2,
        static_load=problem.static_load_n,
        excitation=(folder["excitations"], folder["excitations_on_modes"]),
        observe={"tip": (folder["observed_points"], folder["observed_points_on_modes"])}, friction=0.3,
        damping={"ratio": 0.001},
    )
    settings = {"harmonics": 1, "progress": False}
    np.testing.assert_array_equal(
        again.response([699.5], **settings).amplitude_m,
        problem.response([699.5], **settings).amplitude_m,
    )


def read_array(path):
    """Array of a MatrixMarket file, column by column."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("%")]
    return np.array([float(word) for line in lines[1:] for word in line.split()])


def test_laws_are_exchanged_without_another_reduction(problem):
    other = problem.with_laws(friction=0.1)
    np.testing.assert_array_equal(other.pairs.friction, np.full(72, 0.1))
    of_folder = Problem.from_folder(DATA, friction=0.1, damping={"ratio": 0.001})
    settings = {"harmonics": 1, "progress": False}
    found, expected, before = (
        p.response([699.5], **settings).amplitude_m for p in (other, of_folder, problem)
    )
    np.testing.assert_array_equal(found, expected)
    assert found != before
    each = problem.with_laws(friction=np.linspace(0.1, 0.3, 72))
    assert each.pairs.friction[-1] == 0.3
    springs = problem.with_laws(normal_stiffness_n_m=1e8, tangential_stiffness_n_m=1e8)
    assert np.isinf(problem.pairs.normal_stiffness_n_m).all()
    assert (springs.pairs.tangential_stiffness_n_m == 1e8).all()


def test_harmonics_of_the_excitation_are_complex_amplitudes():
    """A lag of the force is a lag of the motion."""
    def response(excitation):
        problem = Problem.from_matrices(
            np.diag([4.0, 9.0]), np.eye(2), [Pair((None, 1, None), friction=0.3, preload_n=1.0)],
            excitation=excitation, observe={"mass": 0}, damping={"mass_per_s": 0.1},
        )
        return problem.response([0.25], harmonics=3, progress=False).observed_m()[0]

    force = np.array([1.0, 0.0])
    plain, late = response(force), response(force * np.exp(-0.7j))
    np.testing.assert_allclose(late[1], plain[1] * np.exp(-0.7j), rtol=1e-9)
    both = response({1: force, 3: 0.5j * force})
    dynamic = 4 - (3 * 2 * np.pi * 0.25) ** 2 + 0.1j * 3 * 2 * np.pi * 0.25
    assert both[3] == pytest.approx(0.5j / dynamic, rel=1e-9)


@pytest.mark.parametrize("solver", ["newton_krylov", "powell"])
def test_both_solvers_and_an_accuracy_find_the_same_motion(problem, solver):
    plain = problem.response([699.5], harmonics=1, progress=False).amplitude_m
    found = problem.response([699.5], harmonics=1, solver=solver, progress=False)
    np.testing.assert_allclose(found.amplitude_m, plain, rtol=1e-6)
    adapted = problem.response([699.5], accuracy=0.01, progress=False)
    assert adapted.harmonics[0] > 1 and adapted.estimated_error[0, 0] < 0.01


STIFFNESS, MASS, PAIR = np.diag([2.0, 3.0, 4.0]), np.eye(3), Pair((0, 1, 2), friction=0.3)
LOADS = {"excitation": [0.0, 1.0, 0.0], "observe": {"point": 1}}


def skew(by=0.1):
    matrix = STIFFNESS.copy()
    matrix[0, 1] += by
    return matrix


@pytest.mark.parametrize(
    ("error", "words", "change"),
    [
        (ValueError, "stiffness is not symmetric.*(0, 1)", {"stiffness": skew()}),
        (ValueError, "mass is not symmetric", {"mass": MASS + skew() - STIFFNESS}),
        (TypeError, "stiffness is complex", {"stiffness": STIFFNESS + 0j}),
        (TypeError, "float32", {"stiffness": STIFFNESS.astype(np.float32)}),
        (TypeError, "float32", {"mass": sparse.csr_matrix(MASS.astype(np.float32))}),
        (TypeError, "array of numbers", {"stiffness": "K"}),
        (ValueError, "square.*(2, 3)", {"stiffness": STIFFNESS[:2]}),
        (ValueError, "3 rows and mass 2", {"mass": MASS[:2, :2]}),
        (ValueError, "not finite", {"stiffness": STIFFNESS * np.nan}),
        (ValueError, "names degree of freedom 3", {"pairs": [Pair((0, 1, 3), friction=0.3)]}),
        (ValueError, "order n, t1, t2", {"pairs": [PAIR, Pair((2, None, None), friction=0.3)]}),
        (ValueError, "follows one contact", {"pairs": [PAIR, PAIR]}),
        (ValueError, "pairs is empty", {"pairs": []}),
        (ValueError, r"excitation has the shape \(2,\).*\(3,\)", {"excitation": [1.0, 0.0]}),
        (ValueError, "harmonic 0", {"excitation": {0: [1.0, 0.0, 0.0]}}),
        (TypeError, "numbers of harmonics", {"excitation": {"1": [1.0, 0.0, 0.0]}}),
        (ValueError, "observe.*degree of freedom 9", {"observe": {"point": 9}}),
        (ValueError, "fixed names degree of freedom 3", {"fixed": [3]}),
        (ValueError, "highest_hz is -1", {"highest_hz": -1.0}),
        (ValueError, "no key \"zeta\"", {"damping": {"zeta": 0.1}}),
        (ValueError, "excludes", {"damping": {"ratio": 0.1, "mass_per_s": 1.0}}),
        (ValueError, "stiffness is indefinite.*diagonal", {"stiffness": -STIFFNESS, "pairs": [Pair((0, None, None), friction=0.3)]}),
        (ValueError, r"mass is indefinite: entry \(2, 0\)", {"mass": MASS + 9.0 * np.eye(3)[::-1]}),
        (ValueError, "mass is indefinite: 1 of its 3", {"mass": 1.6 * np.eye(3) - 0.6 * np.ones((3, 3))}),
    ],
)
def test_matrices_that_are_none_are_refused_with_the_reason(error, words, change):
    given = {"stiffness": STIFFNESS, "mass": MASS, "pairs": [PAIR]} | LOADS | change
    matrices = [given.pop(name) for name in ("stiffness", "mass", "pairs")]
    with pytest.raises(error, match=words):
        Problem.from_matrices(*matrices, **given)


def test_a_matrix_that_is_symmetric_but_for_rounding_is_taken():
    Problem.from_matrices(skew(1e-13), MASS, [PAIR], **LOADS)


@pytest.mark.parametrize(
    ("words", "change"),
    [
        ("at least 0", {"friction": -0.1}),
        ("finite", {"gap_m": np.inf}),
        ("belong together", {"normal_stiffness_n_m": 1.0}),
        ("above 0", {"normal_stiffness_n_m": 0.0, "tangential_stiffness_n_m": 1.0}),
        ("right angles", {"frame": np.ones((3, 3))}),
        (r"\(2, 3\)", {"frame": np.ones((2, 3))}),
        ("length 3", {"dofs": (0, 1)}),
        ("no degree of freedom", {"dofs": (None, None, None)}),
        ("three degrees of freedom", {"dofs": (0, None, 1), "frame": np.eye(3)}),
    ],
)
def test_pairs_that_are_none_are_refused_with_the_reason(words, change):
    given = {"dofs": (0, 1, 2), "friction": 0.3} | change
    with pytest.raises(ValueError, match=words):
        Pair(given.pop("dofs"), **given)


@pytest.mark.parametrize(
    ("error", "words", "change"),
    [
        (ValueError, "ascend", {"frequencies_hz": [2.0, 1.0]}),
        (ValueError, "above 0", {"frequencies_hz": [0.0, 1.0]}),
        (ValueError, "at least one", {"frequencies_hz": []}),
        (TypeError, "complex", {"frequencies_hz": [1j]}),
        (ValueError, "harmonics is 0", {"harmonics": 0}),
        (ValueError, "16 to", {"samples": 15}),
        (ValueError, "accuracy", {"accuracy": 0.01, "harmonics": 3}),
        (ValueError, "at least two", {"follow": True}),
        (ValueError, "choices", {"eps": "static"}),
        (ValueError, "choices", {"solver": "newton"}),
        (ValueError, "eps_scale", {"eps_scale": 0.0}),
        (ValueError, "tolerance", {"tolerance": -1.0}),
        (dovetail.RunError, "linear_mode = 9999", {"damping": {"ratio": 0.1, "linear_mode": 9999}}),
    ],
)
def test_responses_that_are_none_are_refused_with_the_reason(problem, error, words, change):
    given = {"frequencies_hz": [699.5], "progress": False} | change
    with pytest.raises(error, match=words):
        problem.response(given.pop("frequencies_hz"), **given)


def test_harmonics_that_are_excited_have_to_be_kept():
    problem = Problem.from_matrices(
        STIFFNESS, MASS, [PAIR], excitation={3: [0.0, 1.0, 0.0]}, observe={"point": 1}
    )
    with pytest.raises(ValueError, match="harmonics=3"):
        problem.response([0.1], harmonics=2)


def test_an_undamped_resonance_and_a_folder_that_is_none_are_named(problem, tmp_path):
    undamped = {"stiffness_s": 0.0}
    hz = problem.static_state().linear_frequency_hz[0]
    with pytest.raises(dovetail.RunError, match="no damping"):
        problem.response([hz], damping=undamped)
    with pytest.raises(dovetail.RunError, match="model.json"):
        Problem.from_folder(tmp_path, friction=0.3)


def test_a_body_that_nothing_holds_has_no_static_state():
    problem = Problem.from_reduced(
        np.diag([0.0, 1.0, 1.0]), np.eye(3), np.zeros((3, 0)), [],
        static_load=([1.0, 0.0, 0.0], []), excitation=([1.0, 0.0, 0.0], []),
        observe={"mass": ([1.0, 0.0, 0.0], [])}, friction=0.3,
    )
    assert not problem.static_state().converged
    with pytest.raises(dovetail.RunError, match="static state.*nothing_holds"):
        problem.response([0.1])


@pytest.mark.parametrize("index", [-1, 3])
def test_an_index_outside_of_a_sparse_matrix_is_named(index):
    stiffness = sparse.coo_matrix(STIFFNESS)
    stiffness.row = stiffness.row.copy()
    stiffness.row[0] = index
    with pytest.raises(ValueError, match=f"stiffness has an entry with row {index}, and its rows are 0 to 2"):
        Problem.from_matrices(stiffness, MASS, [PAIR], **LOADS)


def test_an_indefinite_stiffness_is_a_warning():
    # Each pair of rows is possible, and all three together are not.
    stiffness = 1e3 * (np.eye(3) * 1.6 - 0.6 * np.ones((3, 3)))
    assert np.linalg.eigvalsh(stiffness)[0] < 0
    with pytest.warns(UserWarning, match="stiffness is indefinite, with 1 negative"):
        Problem.from_matrices(stiffness, MASS, [PAIR], **LOADS)


def test_a_million_rows_with_neither_stiffness_nor_mass_are_left_out():
    size = 1_000_000
    places = [0, 1, size - 1]
    spread = sparse.csr_matrix((np.ones(3), (places, range(3))), shape=(size, 3))
    matrices = [spread @ sparse.csr_matrix(m) @ spread.T for m in (STIFFNESS, MASS)]
    given = LOADS | {"excitation": spread @ np.asarray(LOADS["excitation"]), "observe": {"last": size - 1}}
    moved = [None if dof is None else places[dof] for dof in (0, 1, 2)]
    pair = Pair(tuple(moved), friction=0.3, preload_n=1.0)
    small = Problem.from_matrices(
        STIFFNESS, MASS, [Pair((0, 1, 2), friction=0.3, preload_n=1.0)],
        **(LOADS | {"observe": {"last": 2}}),
    )
    with pytest.warns(UserWarning, match="999997 rows have neither stiffness nor mass"):
        large = Problem.from_matrices(*matrices, [pair], **given)
    assert np.array_equal(large.stiffness_n_m, small.stiffness_n_m)
    given["observe"] = {"nothing": 7}
    with pytest.raises(ValueError, match='observe."nothing".* degree of freedom 7'):
        Problem.from_matrices(*matrices, [pair], **given)


def test_a_folder_that_a_problem_writes_is_the_problem(tmp_path):
    """A chain of masses without a mesh, with two harmonics and phases."""
    stiffness = np.diag([3.0, 2.0, 1.0]) + 0.0
    stiffness[[0, 1, 1, 2], [1, 0, 2, 1]] = -1.0
    options = {"friction": 0.4}
    pair = Pair((None, 2, None), preload_n=0.5, **options)
    problem = Problem.from_matrices(
        stiffness, np.eye(3), [pair], excitation={1: [0.2 + 0.1j, 0, 0], 3: [0, 0.05j, 0]},
        observe={"first": 0, "last": 2}, damping={"mass_per_s": 0.02},
    )
    folder = tmp_path / "chain"
    problem.to_folder(folder)
    again = Problem.from_folder(folder, damping={"mass_per_s": 0.02}, **options)
    assert again.observations == ["first", "last"]
    assert np.array_equal(again.stiffness_n_m, problem.stiffness_n_m)
    of = [p.response([0.1, 0.2], harmonics=5, progress=False).amplitude_m for p in (problem, again)]
    assert of[0] == pytest.approx(of[1], rel=1e-9) and of[0].min() > 0
    with pytest.raises(ValueError, match=r"positions_m has the shape \(2, 3\)"):
        problem.to_folder(folder, positions_m=np.zeros((2, 3)))


def test_preload_and_clearance_add_up():
    """A pair on a spring of 100 N/m: the preload closes the clearance first."""
    for gap_m, expected_n in [(0.0, 5.0), (0.02, 3.0), (-0.01, 6.0), (0.1, 0.0)]:
        problem = Problem.from_matrices(
            np.diag([100.0]), np.eye(1), [Pair((0, None, None), friction=0.0, preload_n=5.0, gap_m=gap_m)],
            excitation=[1e-6], observe={"mass": 0},
        )
        state = problem.static_state()
        assert -state.contact_force_n[0, 0] == pytest.approx(expected_n, abs=1e-9)


def test_a_stop_doubles_the_period_at_twice_its_resonance():
    # A mass between 1 N/m on one side and 11 N/m on the other, excited at twice its free vibration.
    open_, closed = 1.0, np.sqrt(11.0)
    hz = 4 * open_ * closed / (open_ + closed) / (2 * np.pi)
    stop = Pair((0, None, None), friction=0.0, normal_stiffness_n_m=10.0, tangential_stiffness_n_m=10.0)

    def judged(damping):
        problem = Problem.from_matrices(
            np.eye(1), np.eye(1), [stop], excitation=[0.1], observe={"mass": 0}, damping={"mass_per_s": damping},
        )
        return problem.response([hz], accuracy=0.01, progress=False)[0].stability()

    light, heavy = judged(0.01), judged(1.5)
    assert (light.stable, light.kind, light.reason) == (False, "period_doubling", None)
    assert light.multiplier.real < -1 and light.multiplier.imag == 0
    assert (heavy.stable, heavy.kind) == (True, None) and abs(heavy.multiplier) < 1


def test_a_response_has_its_stability_and_the_motions_of_two_periods():
    stop = Pair((0, None, None), friction=0.0, normal_stiffness_n_m=10.0, tangential_stiffness_n_m=10.0)
    problem = Problem.from_matrices(
        np.eye(1), np.eye(1), [stop], excitation=[0.1], observe={"mass": 0}, damping={"mass_per_s": 0.01},
    )
    found = problem.response([0.3, 0.489139], accuracy=0.01, progress=False)
    assert found.stable == [True, False] and found.instability == [None, "period_doubling"]
    assert abs(found.floquet_multiplier[1] + 3.2) < 0.01 and found.bifurcations == []
    [doubled] = found.two_periods
    [at] = [i for i, hz in enumerate(doubled.frequency_hz) if hz == 0.5 * 0.489139]
    # Half of the frequency of the excitation: odd harmonics tell both periods apart.
    odd = abs(doubled.observed_m()[at, 1::2])
    assert odd.max() > 1.0 and doubled.stable[at] is True
    none = problem.response([0.489139], accuracy=0.01, stability="none", progress=False)
    assert none.stable == [None] and np.isnan(none.floquet_multiplier[0]) and none.two_periods == []
    with pytest.raises(ValueError, match="every_point"):
        problem.response([0.3], stability="all", progress=False)


def test_a_motion_without_known_damping_is_not_judged():
    problem = mass_on_friction(0.2)
    motion = problem.response([0.1], harmonics=3, progress=False)[0]
    assert motion.stability().stable
    balance = problem.balance(0.1, harmonics=3)
    found = balance.motion(motion.u).stability()
    assert found.stable is None and found.multiplier is None and "damping" in found.reason
