"""Shooting: periodic motions of a model at one frequency, their figures with errors, and their multipliers."""

import numpy as np

from motion import Deadline, Figures, NoMotion, System

COARSE, FINE = (1e-9, 60), (1e-11, 120)  # Error of a step relative to the motion, and least steps of a period.
CLOSED = 3e-8  # Largest change over a period, relative to the motion.
RIGID = (50.0, 200.0, 800.0, 3200.0)  # Springs of rigid pairs, times the stiffness of their bodies.
INSTANTS = 1024


def jacobian(lap, z, image, active, share=3e-6):
    """Derivative of the map by the active entries of z, by differences of this share of the motion."""
    eps = share * lap.u_scale
    columns = []
    for i in active:
        moved = z.copy()
        moved[i] += eps
        columns.append((lap.run(moved) - image) / eps)
    return np.array(columns).T


def active_entries(lap, figures):
    """Entries of z that move: not the sliders of pairs that stick all the time."""
    n, p = lap.system.n, lap.system.p
    moving = [2 * n + 2 * q + c for q in range(p) if figures.slips[q] or figures.opens[q] for c in (0, 1)]
    return np.array(list(range(2 * n)) + moving)


def shoot(lap, z, deadline, forward=(20, 60, 150), most=10, J=None):
    """Periodic motion near z, with its figures, active entries and Jacobian."""
    size = lap.u_scale
    figures = Figures()
    image = lap.run(z, figures=figures)
    r = image - z
    for wait in (0, *forward):
        if wait:
            z = lap.run(z, wait)
            image = lap.run(z, figures=figures)
            r, J = image - z, None
        for _ in range(most):
            deadline.check()
            if np.abs(r).max() < CLOSED * size:
                break
            active = active_entries(lap, figures)
            is_new = J is None or J.shape[1] != len(active)
            if is_new:
                J = jacobian(lap, z, image, active)
            step = np.linalg.lstsq(J[active] - np.eye(len(active)), -r[active], rcond=1e-9)[0]
            factor, better = 1.0, False
            while factor > 0.05:
                tried = z.copy()
                tried[active] += factor * step
                others = np.setdiff1d(np.arange(len(z)), active)
                tried[others] = image[others]
                try:
                    after = lap.run(tried, figures=figures)
                except NoMotion:
                    factor *= 0.4
                    continue
                if np.abs(after - tried).max() < (1 - 0.3 * factor) * np.abs(r).max():
                    better = True
                    break
                factor *= 0.4
            if better:
                fell = np.abs(after - tried).max() / np.abs(r).max()
                z, image, r = tried, after, after - tried
                if fell > 0.1:
                    J = None
            elif is_new:
                break
            else:
                J = None
                image = lap.run(z, figures=figures)
        if np.abs(r).max() < CLOSED * size:
            image = lap.run(z, figures=figures)
            return z, figures, J
    raise NoMotion("periodic")


def defined(lap, z, w0, deadline, J=None):
    """Periodic motion near z whose sliders come of those at rest, as the motion goes on from there. A pair that
    slides forgets where it began. One that slides less and less rests against its cone in the end, and where
    that is depends on the motion: a fixed point, by Anderson's acceleration."""
    n, p = lap.system.n, lap.system.p
    tried, off = [], []
    for _ in range(40):
        z, figures, J = shoot(lap, z, deadline, J=J)
        _, path = lap.run(z, instants=INSTANTS)
        w, slides = lap.sliders_of(path, w0)
        own = z[2 * n:].reshape(p, 2)
        w[slides] = own[slides]
        moved = (w - own).ravel()
        if np.abs(moved).max() < 1e-6 * lap.u_scale:
            return z, figures, J
        tried.append(own.ravel().copy())
        off.append(moved)
        after = w.ravel()
        if len(off) > 1:
            A, X = np.diff(off[-6:], axis=0).T, np.diff(tried[-6:], axis=0).T
            weights = np.linalg.lstsq(A, moved, rcond=1e-6)[0]
            after = after - (X + A) @ weights
        z = z.copy()
        z[2 * n:] = after
    raise NoMotion("sliders")


def figures_of(lap, z, figures):
    """The figures as arrays."""
    p, observed = lap.system.p, len(lap.system.weights)
    per_pair = ("friction_w", "slid_m", "most_n", "least_n")
    found = {name: np.array(getattr(figures, name)[:p]) for name in per_pair}
    found["amplitude_m"] = np.array(figures.amplitude[:observed])
    found["damping_w"] = np.array([figures.damping_w])
    found["friction_power_w"] = np.array([found["friction_w"].sum()])
    return found


def multipliers(lap, z):
    """Floquet multipliers, largest first, without those of sliders that rest anywhere, and the sizes of the
    largest by two differences: near a corner of the law these disagree."""
    figures = Figures()
    image = lap.run(z, figures=figures)
    active = active_entries(lap, figures)
    found = [np.linalg.eigvals(jacobian(lap, z, image, active, share)[active]) for share in (3e-6, 3e-5)]
    largest = found[0][np.argsort(-np.abs(found[0]))]
    return largest, [float(np.abs(values).max()) for values in found]


def size_of(lap, z, u0):
    n = lap.system.n
    return max(np.abs(z[:n] - u0).max(), np.abs(z[n:2 * n]).max())


def starts(system, omega, u0, w0, seed, tries):
    """States from which a motion is looked for: at rest, the vibrations of all pairs sticking and of all
    open, and random ones of their size."""
    random = np.random.default_rng(seed)
    closed = -(np.einsum("pi,i->p", system.rows[:, 0], u0) + system.gap) > 0
    stuck = system.linear(omega, closed, w0)
    free = system.linear(omega, np.zeros(system.p, bool), w0)
    size = max(np.abs(stuck[0]).max(), np.abs(stuck[1]).max() / omega)
    yield size, (u0, np.zeros(system.n))
    if tries > 1:
        yield size, (u0 + stuck[0], stuck[1])
    if tries > 2:
        free_size = max(np.abs(free[0]).max(), np.abs(free[1]).max() / omega)
        scale = min(1.0, 5 * size / free_size)
        yield size, (u0 + scale * free[0], scale * free[1])
    for _ in range(tries - 3):
        yield size, (u0 + size * random.normal(size=system.n), omega * size * random.normal(size=system.n))


def is_same(a, b, size):
    return len(a) == len(b) and np.abs(a - b).max() < 1e-4 * size


def refined(lap, z, J, deadline):
    """Figures of the motion with finer steps, their difference to those of the coarse ones, and its
    multipliers."""
    figures = Figures()
    lap.run(z, figures=figures)
    rough = figures_of(lap, z, figures)
    fine = lap.finer(*FINE)
    z, figures, _ = shoot(fine, z, deadline, forward=(), most=8, J=J)
    values = figures_of(fine, z, figures)
    errors = {name: np.abs(values[name] - rough[name]) for name in values}
    return fine, z, values, errors, figures


def solutions_elastic(model, hz, tries, seconds, seed, from_states=(), rigid_n_m=None, define=True):
    """Periodic motions found from several starts. Each is a dictionary with the figures (`values`), their
    errors (`errors`), the largest multiplier, and the state."""
    deadline = seconds if isinstance(seconds, Deadline) else Deadline(seconds)
    omega = 2 * np.pi * hz
    system = System(model, rigid_n_m)
    u0, w0 = system.static_state()
    found, reasons = [], []
    candidates = [(None, state) for state in from_states] or starts(system, omega, u0, w0, seed, tries)
    for size, state in candidates:
        try:
            if size is None:
                z0 = state(system) if callable(state) else np.array(state)
                size = max(np.abs(z0[: system.n] - u0).max(), np.abs(z0[system.n: 2 * system.n]).max())
                lap = system.at(omega, size, *COARSE)
            else:
                lap = system.at(omega, size, *COARSE)
                z0 = lap.run(lap.join(*state, w0), 10)
                lap = system.at(omega, max(size_of(lap, z0, u0), 1e-3 * size), *COARSE)
            z, figures, J = defined(lap, z0, w0, deadline) if define else shoot(lap, z0, deadline)
            scale = size_of(lap, z, u0)
            if any(is_same(z, other["coarse"], scale) for other in found):
                continue
            coarse = z
            lap = system.at(omega, scale, *COARSE)
            fine, z, values, errors, figures = refined(lap, z, J, deadline)
            largest, sizes = multipliers(fine, z)
            found.append({"rigid_n_m": rigid_n_m, "values": values, "errors": errors, "multipliers": largest[:4], "largest": sizes, "z": z, "coarse": coarse, "size": scale,
                          "slips": list(figures.slips[: system.p]), "opens": list(figures.opens[: system.p]),
                          "touches": list(figures.touches[: system.p])})
        except (NoMotion, np.linalg.LinAlgError) as error:
            reasons.append(str(error))
            if str(error) == "time":
                break
    return found, reasons


def stiffness_of(model):
    """Stiffness of the bodies at the pairs, N/m."""
    system = System(model, 1.0)
    own = np.einsum("pci,ij,pcj->pc", system.rows, system.K, system.rows)
    return own.mean()


def solutions(model, hz, tries=3, seconds=20.0, seed=0, from_states=()):
    """Like `solutions_elastic`; rigid pairs have springs of growing stiffness, and the figures are
    extrapolated to infinite stiffness."""
    if all(pair["normal_stiffness_n_m"] is not None for pair in model["pairs"]):
        return solutions_elastic(model, hz, tries, seconds, seed, from_states)
    own, deadline = stiffness_of(model), Deadline(2 * seconds)
    first, reasons = solutions_elastic(model, hz, tries, deadline, seed, from_states, RIGID[0] * own)
    levels = [[found] for found in first]
    for chain in levels:
        for ratio in RIGID[1:]:
            start = restiffened(chain[-1]["z"], System(model, chain[-1]["rigid_n_m"]))
            more, why = solutions_elastic(model, hz, 1, deadline, seed, from_states or [start], ratio * own)
            if not more:
                reasons += why
                break
            chain.append(more[0])
    complete = [extrapolated(chain) for chain in levels if len(chain) == len(RIGID)]
    return complete, reasons


def shifted(system, u, depths):
    """Displacements u moved in the way of a static load, so that pairs have these depths of penetration where
    they are above 0."""
    rows = system.contact_rows()
    x = (rows @ u).reshape(-1, 3)
    closed = np.flatnonzero(depths > 0)
    if not len(closed):
        return u
    normals = rows[3 * closed]
    rise = -depths[closed] - system.gap[closed] - x[closed, 0]
    moved = np.linalg.solve(system.K, normals.T)
    return u + moved @ np.linalg.lstsq(normals @ moved, rise, rcond=None)[0]


def restiffened(z, softer):
    """Start for stiffer springs from the motion with softer ones: the springs have the same forces."""

    def state(system):
        n, start = system.n, z.copy()
        x = (softer.contact_rows() @ z[:n]).reshape(-1, 3)
        depths = -(x[:, 0] + softer.gap) * softer.kn / system.kn
        start[:n] = shifted(system, start[:n], depths)
        after = (softer.contact_rows() @ start[:n]).reshape(-1, 3)[:, 1:]
        shear = x[:, 1:] - z[2 * n:].reshape(-1, 2)
        start[2 * n:] = (after - shear * (softer.kt / system.kt)[:, None]).ravel()
        return start

    return state


def started_from(hz, force_n, displacement_m):
    """Start from a motion given by the complex amplitudes (H+1, pairs, 3) of its contact forces and relative
    displacements: the bodies follow from the forces, the sliders from those at rest."""
    w = 2 * np.pi * hz
    orders = np.arange(len(force_n))

    def state(system):
        n = system.n
        u, v = np.zeros(n), np.zeros(n)
        for h in orders:
            f = system.f0 + 0j if h == 0 else np.zeros(n, complex)
            for order, c, s in zip(system.orders, system.cosine, system.sine):
                f += (c + 1j * s) * (order == h)
            f -= system.contact_rows().T @ force_n[h].ravel()
            z = system.K - (h * w) ** 2 * system.M + 1j * h * w * (system.alpha * system.K + system.beta * system.M)
            amplitude = np.linalg.solve(z, f)
            u, v = u + amplitude.real, v - h * amplitude.imag
        turn = np.exp(2j * np.pi * np.outer(np.arange(INSTANTS) / INSTANTS, orders))
        path = np.einsum("th,hpc->tpc", turn, displacement_m).real
        normal = np.einsum("th,hp->tp", turn, force_n[:, :, 0]).real
        if np.isfinite(system.rigid):
            path[:, :, 0] = np.where(normal < 0, -system.gap + normal / system.kn, path[:, :, 0])
            u = shifted(system, u, -normal[0] / system.kn)
        size = np.abs(u - system.static_state()[0]).max()
        sliders = system.at(w, size).sliders_of(path, system.static_state()[1])[0]
        return np.concatenate([u, v, sliders.ravel()])

    return state


def extrapolated(chain):
    """Values at infinite stiffness. At each reversal a pair with springs sticks for a time that falls with the
    root of the stiffness, and the levels halve this: the series is one in this time. The errors are the
    differences to the extrapolation without the first level, and a tenth of what the first two of four change:
    softer pairs may do something else."""
    last = chain[-1]

    def limit(levels):
        table = list(levels)
        for order in range(1, len(levels)):
            table = [(2**order * b - a) / (2**order - 1) for a, b in zip(table, table[1:])]
        return table[0]

    values, errors = {}, {}
    for name in last["values"]:
        levels = [found["values"][name] for found in chain]
        values[name] = limit(levels)
        errors[name] = np.abs(values[name] - limit(levels[1:])) + 10 * last["errors"][name]
        errors[name] += 0.1 * np.abs(limit(levels[1:]) - limit(levels[2:]))
    return {**last, "values": values, "errors": errors}
