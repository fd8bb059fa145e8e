"""Factors of the noise covariance of the voltage equations of three phases, block-tridiagonal over the intervals.

Among the phases that conduct currents sum to zero; see ``nine``, which they are for.
"""

import numpy as np

from ..compiled import compiled

NEGLIGIBLE = 1e-100  # what has died away is cut off, as denormal numbers slow everything after them down


@compiled
def share(live, out):
    """Fill ``out`` (3, 3) with I - 1 1'/m among the m live phases: covariance of currents that sum to zero."""
    m = 0
    for j in range(3):
        if live[j]:
            m += 1
    for a in range(3):
        for b in range(3):
            both = live[a] and live[b]
            out[a, b] = ((1.0 if a == b else 0.0) - 1.0 / m) if both else 0.0


@compiled
def factor(R, lever, slope, live, live_end, voltage, current, current_end, speed):
    """Factors of the rows' noise covariance Omega = T T': diagonal blocks C (lower) and blocks G before them.

    Parameters
    ----------
    R : (phase,) ohm; lever : (phase,) L/interval (ohm)
    slope : (row, phase) change of the voltage with speed (V s/rad)
    voltage, current, current_end, speed : 1 sigma (V, A, A, rad/s)
    """
    rows = len(live)
    C, G = np.zeros((rows, 3, 3)), np.zeros((rows, 3, 3))
    mean, start, stop = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    share(live_end[0], start)
    for n in range(rows):
        share(live[n], mean)
        share(live_end[n + 1], stop)
        c, g = C[n], G[n]
        if n > 0:  # g = B C'^-1 with B the covariance of this row's phases with those of the row before
            before = C[n - 1]
            for a in range(3):
                for b in range(3):
                    x = -lever[a] * lever[b] * current_end**2 * start[a, b]
                    for l in range(b):
                        x -= g[a, l] * before[b, l]
                    g[a, b] = x / before[b, b]
        for a in range(3):
            for b in range(a + 1):
                x = R[a] * R[b] * current**2 * mean[a, b]
                x += lever[a] * lever[b] * current_end**2 * (start[a, b] + stop[a, b])
                x += slope[n, a] * slope[n, b] * speed**2
                if a == b:
                    x += voltage**2
                for l in range(3):
                    x -= g[a, l] * g[b, l]
                for l in range(b):
                    x -= c[a, l] * c[b, l]
                c[a, b] = np.sqrt(x) if a == b else x / c[b, b]
        start, stop = stop, start
    return C, G


@compiled
def forward(C, G, table):
    """T^-1 table, ``table`` (row, phase, column)."""
    rows, _, columns = table.shape
    out = np.empty((rows, 3, columns))
    for n in range(rows):
        for a in range(3):
            for q in range(columns):
                x = table[n, a, q]
                if n > 0:
                    for l in range(3):
                        x -= G[n, a, l] * out[n - 1, l, q]
                for l in range(a):
                    x -= C[n, a, l] * out[n, l, q]
                x /= C[n, a, a]
                out[n, a, q] = x if abs(x) > NEGLIGIBLE else 0.0
    return out


@compiled
def backward(C, G, table):
    """T'^-1 table, ``table`` (row, phase)."""
    rows = len(table)
    out = np.empty((rows, 3))
    for n in range(rows - 1, -1, -1):
        for a in range(2, -1, -1):
            x = table[n, a]
            if n + 1 < rows:
                for l in range(3):
                    x -= G[n + 1, l, a] * out[n + 1, l]
            for l in range(a + 1, 3):
                x -= C[n, l, a] * out[n, l]
            out[n, a] = x / C[n, a, a]
    return out


@compiled
def project(values, live):
    """(row, phase) values with the mean over the live phases taken off, zero where not live."""
    out = np.zeros(values.shape)
    for n in range(len(values)):
        total, m = 0.0, 0
        for j in range(3):
            if live[n, j]:
                total += values[n, j]
                m += 1
        for j in range(3):
            if live[n, j]:
                out[n, j] = values[n, j] - total / m
    return out
