#!/usr/bin/env python3
"""A mass on a spring k, with a Jenkins element (spring kd and slider fc in series), integrated in time from event to
event by scipy: amplitude and friction work of a cycle in the steady state. Shares nothing with dovetail.

    python3 benches/jenkins_in_time.py
"""

import numpy as np
from scipy.integrate import solve_ivp

K, KD, LIMIT, DAMPING, FORCE, OMEGA = 1.0, 0.5, 0.2, 0.02, 0.25, 1.05
STUCK = 0


def cycle(start, u, v, x, state):
    """One period from (u, v, slider x, state: stuck or direction of slip); also work and extremes of u."""
    t, end, work, extremes = start, start + 2 * np.pi / OMEGA, 0.0, [u, u]
    while t < end - 1e-14:
        def slope(t, y):
            element = KD * (y[0] - x) if state == STUCK else state * LIMIT
            return [y[1], FORCE * np.cos(OMEGA * t) - DAMPING * y[1] - K * y[0] - element]
        if state == STUCK:
            events = [lambda t, y: KD * (y[0] - x) - LIMIT, lambda t, y: KD * (y[0] - x) + LIMIT]
            events[0].direction, events[1].direction = 1, -1
        else:
            events = [lambda t, y: y[1]]
            events[0].direction = -state
        for event in events:
            event.terminal = True
        found = solve_ivp(slope, (t, end), [u, v], method="DOP853", rtol=1e-12, atol=1e-13, max_step=0.2,
                          events=events)
        before, t, (u, v) = u, found.t[-1], found.y[:, -1]
        extremes = [min(extremes[0], found.y[0].min()), max(extremes[1], found.y[0].max())]
        if state != STUCK:
            work += LIMIT * abs(u - before)
            x = u - state * LIMIT / KD
        if found.status == 1:
            state = STUCK if state != STUCK else (1 if len(found.t_events[0]) else -1)
    return u, v, x, state, work, extremes


now = (0.0, 0.0, 0.0, STUCK)
for n in range(400):
    *now, work, (low, high) = cycle(2 * np.pi / OMEGA * n, *now)
print(f"amplitude {(high - low) / 2:.9f}, work of a cycle {work:.9f}")
