"""DLFT with the exact Jacobian and a dense LU, in plain numpy: what a careful user writes in an afternoon.

    numpy_newton.py SCENE HARMONICS OUT.json [PERIODS [SAMPLES]]

PERIODS: marched exactly, as pyHarm does (3); `periodic` or not given: until periodic, as dovetail does. SAMPLES: those of
the scene where not given. The law is evaluated at the samples alone; dovetail follows a pair between them, too.

Shares no code with dovetail but the equations (docs/method.md, sections 3 to 6). Unknown U: array (2H+1, n), rows mean, cos 1, sin 1,
cos 2, ...; all pairs are marched together, Python loops over the samples only.
"""

import dataclasses
import json
import sys
import time

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from reduced_model import read_case

PLAIN_PERIODS, MOST_PERIODS = 6, 40
PERIODICITY = 1e-12  # of the largest predicted force
TOUCH = 1e-8  # of it: nearer to the cone a sample counts as sliding in the derivative


def fourier(harmonics, samples):
    """Values at the samples from coefficients (samples x 2H+1), and back (2H+1 x samples)."""
    angle = 2 * np.pi * np.arange(samples) / samples
    columns = [np.ones(samples)]
    for k in range(1, harmonics + 1):
        columns += [np.cos(k * angle), np.sin(k * angle)]
    to_time = np.column_stack(columns)
    weight = np.full(2 * harmonics + 1, 2.0 / samples)
    weight[0] = 1.0 / samples
    return to_time, weight[:, None] * to_time.T


class March:
    """The contact law over the period: lambda(lambda_u) of all pairs and its derivative with the history of slip.

    A pair is marched until the end of a period is its start, at first one period after the other, then by Newton's method on that
    map (pairs that shake down approach it like one over the periods); or for a given number of periods.
    """

    def __init__(self, friction, start, to_time, to_frequency, periods=None):
        self.mu, self.start, self.exactly = friction, start.reshape(-1, 2), periods
        self.to_time, self.to_frequency = to_time, to_frequency

    def law(self, normal, predicted, touch=0.0):
        """Pressed, sliding (from `touch` N inside the cone), the factor from predicted to contact shear, that shear."""
        pressed = normal < 0
        limit = self.mu * np.abs(normal)
        size = np.hypot(predicted[:, 0], predicted[:, 1])
        slips = pressed & (size >= limit - touch)
        factor = np.where(slips, limit / np.where(slips, size, 1.0), pressed.astype(float))
        return pressed, slips, factor, factor[:, None] * predicted

    def slope(self, predicted, slips, factor):
        """d force / d predicted (1 where it sticks, 0 where open, factor (I - e e^T) where it slips), and e."""
        e = predicted / np.maximum(np.hypot(predicted[:, 0], predicted[:, 1]), 1e-300)[:, None]
        keep = factor[:, None, None] * np.eye(2)
        keep -= np.where(slips, factor, 0.0)[:, None, None] * e[:, :, None] * e[:, None]
        return keep, e

    def signal(self, u):
        return (self.to_time @ u).reshape(len(self.to_time), -1, 3)

    def forces(self, u):
        """lambda (2H+1, n) of lambda_u (2H+1, n); for each pair the periods marched and the shear before the last."""
        signal = self.signal(u)
        scale = np.abs(signal).max()
        out = np.empty_like(signal)
        pairs, shear = np.arange(signal.shape[1]), self.start
        periods, last = np.zeros(len(pairs), dtype=int), self.start.copy()
        while len(pairs) and periods.max() < (self.exactly or MOST_PERIODS):
            before, part = shear, signal[:, pairs]
            solve = not self.exactly and periods.max() >= PLAIN_PERIODS
            forces = np.empty_like(part)
            memory = np.tile(np.eye(2), (len(pairs), 1, 1))  # d shear / d shear at the start
            for n, at in enumerate(part):
                predicted = at[:, 1:] - shear
                pressed, slips, factor, tangential = self.law(at[:, 0], predicted)
                forces[n, :, 0] = np.where(pressed, at[:, 0], 0.0)
                forces[n, :, 1:] = tangential
                shear = at[:, 1:] - tangential
                if solve:
                    memory = self.slope(predicted, slips, factor)[0] @ memory
            out[:, pairs] = forces
            periods[pairs] += 1
            last[pairs] = before
            if not self.exactly:
                moved = shear - before
                open_ended = np.abs(moved).max(axis=1) > PERIODICITY * scale
                if solve:
                    shear = before + (np.linalg.pinv(np.eye(2) - memory) @ moved[:, :, None])[:, :, 0]
                pairs, shear = pairs[open_ended], shear[open_ended]
        return self.to_frequency @ out.reshape(len(out), -1), (periods, last)

    def derivative(self, u, ends):
        """D[pair, i, c, j, d]: of lambda's component i, coefficient c, by lambda_u's j, d."""
        samples, m = self.to_time.shape
        periods, last = ends
        signal = self.signal(u)
        i, c = np.ogrid[:3, :m]
        D = np.zeros((signal.shape[1], 3, m, 3, m))
        D[:, i, c, i, c] = 1.0  # of a pair that sticks at every sample
        # Only pairs that slide or open at some time have a history.
        shear = self.start
        slides = np.zeros(len(D), dtype=bool)
        for at in signal:
            pressed, slips, _, tangential = self.law(at[:, 0], at[:, 1:] - shear)
            slides |= slips | ~pressed
            shear = at[:, 1:] - tangential
        solved = periods > (self.exactly or PLAIN_PERIODS)
        for count in np.unique(periods[~solved]):
            group = np.flatnonzero(slides & (periods == count))
            if len(group):
                D[group] = self.history(signal[:, group], self.start[group], count)[0]
        group = np.flatnonzero(slides & solved)
        if len(group):
            # The shear before the last period is a fixed point: its derivative closes the period.
            touch = TOUCH * np.abs(signal).max()
            _, end, memory = self.history(signal[:, group], last[group], 1, touch=touch)
            begin = np.linalg.pinv(np.eye(2) - memory, rcond=1e-10) @ end
            D[group] = self.history(signal[:, group], last[group], 1, begin, touch)[0]
        return D

    def history(self, signal, shear, periods, d_shear=0.0, touch=0.0):
        """Marched for `periods` periods: D, d shear at the end by lambda_u, and by the shear at the start."""
        samples, m = self.to_time.shape
        pairs = signal.shape[1]
        d_shear = np.zeros((pairs, 2, 3 * m)) + d_shear
        memory = np.tile(np.eye(2), (pairs, 1, 1))
        of_samples = np.zeros((samples, pairs, 3, 3 * m))
        for _ in range(periods):
            for n, at in enumerate(signal):
                row = self.to_time[n]
                predicted = at[:, 1:] - shear
                pressed, slips, factor, tangential = self.law(at[:, 0], predicted, touch)
                keep, e = self.slope(predicted, slips, factor)
                d_predicted = -d_shear
                d_predicted[:, 0, m : 2 * m] += row
                d_predicted[:, 1, 2 * m :] += row
                d_force = keep @ d_predicted
                d_force[:, :, :m] -= np.where(slips, self.mu, 0.0)[:, None, None] * e[:, :, None] * row
                shear = at[:, 1:] - tangential
                of_samples[n, :, 1:] = d_force
                of_samples[n, :, 0, :m] = pressed[:, None] * row
                d_shear = -d_force
                d_shear[:, 0, m : 2 * m] += row
                d_shear[:, 1, 2 * m :] += row
                if periods == 1:
                    memory = keep @ memory
        D = (self.to_frequency @ of_samples.reshape(samples, -1)).reshape(m, pairs, 3, 3, m)
        return D.transpose(1, 2, 0, 3, 4), d_shear, memory


class Balance:
    """f(U) = Lambda U + lambda(U) - F and J = (I - D) Lambda + D eps."""

    def __init__(self, stiffness, force, eps, march):
        # stiffness: per harmonic 0..H a complex n x n; force: (2H+1, n).
        self.stiffness, self.force, self.eps, self.march = stiffness, force, eps, march

    def residual(self, U):
        linear = np.empty_like(U)
        linear[0] = self.stiffness[0].real @ U[0]
        for k, block in enumerate(self.stiffness[1:], 1):
            f = block @ (U[2 * k - 1] - 1j * U[2 * k])
            linear[2 * k - 1], linear[2 * k] = f.real, -f.imag
        u = self.force - linear + self.eps * U
        contact, ends = self.march.forces(u)
        return linear + contact - self.force, u, ends

    def jacobian(self, u, ends):
        m, n = self.force.shape
        pairs = n // 3
        D = self.march.derivative(u, ends)
        E = -D
        i, c = np.ogrid[:3, :m]
        E[:, i, c, i, c] += 1.0
        J = np.empty((m, pairs, 3, m, n))
        for k, block in enumerate(self.stiffness):
            A, B = block.real, block.imag
            real = A[None, None] if k == 0 else np.array([[A, B], [-B, A]])  # (d, d', n, n)
            at = slice(0, 1) if k == 0 else slice(2 * k - 1, 2 * k + 1)
            width = at.stop - at.start
            # Rows of a pair: (component j, coefficient d) x (coefficient d', unknown).
            rows = real.reshape(width, width, pairs, 3, n).transpose(2, 3, 0, 1, 4)
            rows = rows.reshape(pairs, 3 * width, width * n)
            left = E[..., at].reshape(pairs, 3 * m, 3 * width)
            product = (left @ rows).reshape(pairs, 3, m, width, n)
            J[:, :, :, at] = product.transpose(2, 0, 1, 3, 4)
        eps = self.eps.reshape(pairs, 3)
        for pair in range(pairs):
            J[:, pair, :, :, 3 * pair : 3 * pair + 3] += (D[pair] * eps[pair][:, None]).transpose(1, 0, 3, 2)
        return J.reshape(m * n, m * n)

    def measure(self, f):
        """The measure of convergence of docs/method.md."""
        mean = np.linalg.norm(f[0]) / np.linalg.norm(self.force)
        if len(f) == 1:
            return mean
        return max(mean, np.linalg.norm(f[1:]) / np.linalg.norm(self.force[1:]))


def newton(balance, U, tolerance, most_iterations=60):
    """Newton's method damped by natural monotonicity; (U, measure, iterations)."""
    f, u, ends = balance.residual(U)
    measure = balance.measure(f)
    length = lambda dx: np.linalg.norm(balance.eps * dx)
    for iteration in range(most_iterations):
        if measure <= tolerance:
            return U, measure, iteration
        factors = lu_factor(balance.jacobian(u, ends), overwrite_a=True, check_finite=False)
        step = -lu_solve(factors, f.ravel()).reshape(U.shape)
        s = 1.0
        while s >= 1 / 1024:
            trial = U + s * step
            f_trial, u_trial, ends_trial = balance.residual(trial)
            measure_trial = balance.measure(f_trial)
            if measure_trial <= (1 - s / 2) * measure:
                break
            simplified = lu_solve(factors, f_trial.ravel()).reshape(U.shape)
            if length(simplified) <= (1 - s / 4) * length(step):
                break
            s /= 2
        else:
            return U, measure, iteration + 1
        U, f, u, ends, measure = trial, f_trial, u_trial, ends_trial, measure_trial
    return U, measure, most_iterations


def static_state(model, load_steps):
    """X under the preload, which comes on in equal steps from the unloaded, stuck state."""
    x = np.zeros((1, len(model.static_n)))
    one = np.ones((1, 1))
    for i in range(1, load_steps + 1):
        start = (model.eps * x[0]).reshape(-1, 3)[:, 1:]
        march = March(model.friction, start, one, one, periods=1)
        balance = Balance([model.K], model.static_n[None] * (i / load_steps), model.eps, march)
        x, measure, _ = newton(balance, x, 1e-10, 200)
        if measure > 1e-10:
            raise SystemExit(f"static state: load step {i} stopped at a residual of {measure:.1e}")
    return x[0]


def balance_at(case, omega, x_static, periods):
    """The balance of one frequency, its march starting at the static state."""
    model, H = case.model, case.harmonics
    condensed = [model.condensed(k * omega) for k in range(H + 1)]
    force = np.zeros((2 * H + 1, len(x_static)))
    force[0] = model.static_n
    force[1], force[2] = condensed[1][1].real, -condensed[1][1].imag
    start = (model.eps * x_static).reshape(-1, 3)[:, 1:]
    march = March(model.friction, start, *fourier(H, case.samples), periods)
    return Balance([c[0] for c in condensed], force, model.eps, march)


def main():
    case = read_case(sys.argv[1], int(sys.argv[2]))
    periods, samples = (sys.argv[4:] + [None, None])[:2]
    periods = None if periods in (None, "periodic") else int(periods)
    if samples is not None:
        case = dataclasses.replace(case, samples=int(samples))
    begin = time.perf_counter()
    x_static = static_state(case.model, case.load_steps)
    print(f"static state: {time.perf_counter() - begin:.2f} s")
    at_rest = np.zeros((2 * case.harmonics + 1, len(x_static)))
    at_rest[0] = x_static
    last, points = at_rest, []
    for hz in case.hz:
        begin, processor = time.perf_counter(), time.process_time()
        omega = 2 * np.pi * hz
        balance = balance_at(case, omega, x_static, periods)
        U, measure, iterations = newton(balance, last, case.tolerance)
        if measure > case.tolerance and last is not at_rest:
            U, measure, more = newton(balance, at_rest, case.tolerance)
            iterations += more
        converged = bool(measure <= case.tolerance)
        last = U if converged else at_rest
        seconds, processor = time.perf_counter() - begin, time.process_time() - processor
        tip = abs(case.model.tip(omega, 1, U[1] - 1j * U[2]))
        print(f"{hz:.3f} Hz: {tip:.9e} m, residual {measure:.1e}, {iterations} iterations, {seconds:.2f} s ({processor:.2f})", flush=True)
        points.append(
            dict(hz=hz, tip_m=tip, residual=measure, converged=converged, iterations=iterations)
            | dict(seconds=seconds, processor_s=processor)
        )
    with open(sys.argv[3], "w") as file:
        json.dump(dict(points=points, x_static=x_static.tolist()), file)


if __name__ == "__main__":
    main()
