"""Random small models of bodies that touch: one seed makes one model, with two or three frequencies.

Chains of 1 to 7 points with three displacements each, held and joined by springs in all directions, with 1 to 6
contacts, to ground and between points. The numbers of a model are rounded to six digits, so that its text is short
and the same everywhere.
"""

import numpy as np

KINDS = ("elastic", "rigid")
FEATURES = ("gap", "preload", "interference", "frame", "between", "harmonics", "one_direction")


def rounded(values, digits=6):
    array = np.asarray(values, float)
    return np.array([float(f"{v:.{digits}g}") for v in array.ravel()]).reshape(array.shape)


def positive(random, size):
    """Symmetric positive definite 3 x 3 block about this size, in turned directions."""
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return turn @ np.diag(size * 10 ** random.uniform(-0.7, 0.3, 3)) @ turn.T


def frame_of(random):
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


def bodies(random, points):
    """Stiffness and mass of points that are held and joined, with a first frequency of 10 to 500 Hz."""
    base = 10 ** random.uniform(-1, 1)
    mass = np.repeat(rounded(base * 10 ** random.uniform(-0.4, 0.4, points), 4), 3)
    k0 = base * (2 * np.pi * 10 ** random.uniform(1, 2.7)) ** 2
    K = np.zeros((3 * points, 3 * points))
    for i in range(points):
        held = 10 ** random.uniform(-1.3, 0.3) if i else 1.0
        at = slice(3 * i, 3 * i + 3)
        K[at, at] += positive(random, held * k0)
        for j in range(i):
            if j == i - 1 or random.random() < 0.2:
                block, other = rounded(positive(random, k0 * 10 ** random.uniform(-0.5, 0.7))), slice(3 * j, 3 * j + 3)
                K[at, at] += block
                K[other, other] += block
                K[at, other] -= block
                K[other, at] -= block.T
    K = rounded(K, 8)
    return (K + K.T) / 2, np.diag(mass)


def contacts(random, points, kind, has):
    """Pairs: their points, and all of their law besides what depends on forces."""
    most = min(points, 6)
    count = int(random.integers(1, most + 1)) if points > 1 else 1
    slaves = random.permutation(points)[:count]
    free = [i for i in range(points) if i not in slaves]
    one_friction = 10 ** random.uniform(-1.3, 0)
    pairs = []
    for i in slaves:
        against = None
        if has["between"] and free and random.random() < 0.7:
            other = int(random.choice(free))
            against = [3 * other + c for c in range(3)]
        friction = random.choice([one_friction, 10 ** random.uniform(-1.3, 0.2), 0.0], p=[0.75, 0.2, 0.05])
        pairs.append({"unknowns": [3 * int(i) + c for c in range(3)], "against": against,
                      "frame": frame_of(random).tolist() if has["frame"] else None,
                      "friction": float(rounded(friction, 4)), "gap_m": 0.0, "preload_n": 0.0,
                      "normal_stiffness_n_m": None, "tangential_stiffness_n_m": None})
    return pairs


def model(seed, kind=None):
    """The model of a seed. Without a kind, two of three have elastic pairs."""
    random = np.random.default_rng(seed)
    chosen = "rigid" if random.random() < 1 / 3 else "elastic"
    kind = kind or chosen
    chance = {"gap": 0.25, "preload": 0.6, "interference": 0.2, "frame": 0.5, "between": 0.5, "harmonics": 0.3, "one_direction": 0.2}
    has = {name: bool(random.random() < chance[name]) for name in FEATURES}
    points = int(random.choice([1, 2, 3, 4, 5, 6, 7], p=[0.2, 0.25, 0.2, 0.12, 0.09, 0.08, 0.06]))
    K, M = bodies(random, points)
    pairs = contacts(random, points, kind, has)
    size, mass = len(K), np.diag(M)
    rows = np.zeros((len(pairs), 3, size))
    for p, pair in enumerate(pairs):
        frame = np.eye(3) if pair["frame"] is None else np.array(pair["frame"])
        rows[p][:, pair["unknowns"]] += frame
        if pair["against"]:
            rows[p][:, pair["against"]] -= frame
    own = np.einsum("pci,ij,pcj->pc", rows, K, rows).mean(axis=1)
    force_n = 10 ** random.uniform(0, 3)
    stiff = 10 ** random.uniform(-0.3, 1.7)
    for p, pair in enumerate(pairs):
        if kind == "elastic":
            pair["normal_stiffness_n_m"] = float(rounded(stiff * own[p], 5))
            pair["tangential_stiffness_n_m"] = float(rounded(stiff * own[p] * random.uniform(0.4, 1.2), 5))
    # Steady load: along the normals, so that the pairs are pressed, with a share along the contacts.
    load = np.zeros(size)
    for p, pair in enumerate(pairs):
        along = random.uniform(-0.5, 0.5, 2) * pair["friction"] * (random.random() < 0.5)
        if has["preload"] and random.random() < 0.8:
            pair["preload_n"] = float(rounded(force_n * 10 ** random.uniform(-0.5, 0.5), 4))
        else:
            load -= force_n * 10 ** random.uniform(-0.5, 0.5) * rows[p, 0]
        load += force_n * along @ rows[p, 1:]
        if has["interference"] and random.random() < 0.7:
            pair["gap_m"] = -float(rounded(force_n / own[p] * 10 ** random.uniform(-1, 0.5), 4))
        elif has["gap"] and random.random() < 0.6:
            pair["gap_m"] = float(rounded(force_n / own[p] * 10 ** random.uniform(-1, 1), 4))
    springs = 1e3 * own if kind == "rigid" else np.array([pair["normal_stiffness_n_m"] for pair in pairs])
    stuck = K + sum(rows[p].T @ rows[p] * springs[p] for p in range(len(pairs)))
    root = np.diag(mass**-0.5)
    stuck_hz, open_hz = (np.sqrt(np.linalg.eigvalsh(root @ k @ root)) / 2 / np.pi for k in (stuck, K))
    low = [f for f in stuck_hz if f < 20 * open_hz[0]][:4] or [open_hz[0]]
    near = float(random.choice(np.concatenate([low, open_hz[:3]])))
    order = float(random.choice([1, 1, 1, 1, 0.5, 1 / 3, 2]))
    spread = 10 ** random.uniform(-2.5, -0.7)
    frequencies = sorted(near * order * (1 + spread * random.uniform(-1, 1, int(random.integers(2, 4)))))
    # Damping: light to heavy, of stiffness or mass or both.
    ratio = 10 ** random.uniform(-3, -1)
    share = random.choice([0.0, 1.0, 0.5])
    w = 2 * np.pi * near
    damping = {"stiffness_s": float(rounded(2 * share * ratio / w, 5)), "mass_per_s": float(rounded(2 * (1 - share) * ratio * w, 5))}
    # Excitation whose forces on stuck pairs are 0.2 to 12 times what friction holds.
    orders = [1] + ([int(k) for k in sorted(random.choice([2, 3, 4], int(random.integers(1, 3)), replace=False))] if has["harmonics"] else [])
    shapes = []
    for k in orders:
        shape = (random.normal(size=size) + 1j * random.normal(size=size)) * (random.random(size) < 0.5)
        if has["one_direction"] or not np.any(shape):
            shape = np.zeros(size, complex)
            shape[random.integers(size)] = 1
        shapes.append(shape / np.linalg.norm(shape) * (1 if k == 1 else random.uniform(0.1, 0.7)))
    w = 2 * np.pi * frequencies[0]
    dynamic = [np.linalg.solve(stuck - (k * w) ** 2 * M + 1j * k * w * (damping["stiffness_s"] * K + damping["mass_per_s"] * M), s)
               for k, s in zip(orders, shapes)]
    held = max(max(pair["friction"], 0.1) * force_n for pair in pairs)
    pull = max(springs[p] * np.abs(rows[p] @ d).max() for p in range(len(pairs)) for d in dynamic)
    factor = 10 ** random.uniform(-0.7, 1.1) * held / pull
    excitation = {str(k): {"re": rounded(factor * s.real, 5).tolist(), "im": rounded(factor * s.imag, 5).tolist()} for k, s in zip(orders, shapes)}
    moved = np.abs(sum(np.abs(d) for d in dynamic))
    seen = random.choice(np.flatnonzero(moved > 0.2 * moved.max()))
    observe = np.zeros(size)
    observe[seen] = 1
    return {"seed": int(seed), "kind": kind, "has": [name for name in FEATURES if has[name]], "K": K.tolist(), "M": M.tolist(),
            "damping": damping, "pairs": pairs, "static_load": rounded(load).tolist(), "excitation": excitation,
            "observe": [observe.tolist()], "frequency_hz": [float(f"{f:.7g}") for f in frequencies]}
