"""Heat through contacts that touch: C m dT/dt = sum of H (T_neighbour - T) + source."""

from __future__ import annotations

from numba import njit

from hpcdem.core.fields import RADIUS, X, Y


@njit(cache=True, nogil=True, error_model="numpy")
def inflow(hot, row, partner, first, end, temperature, conductance, flow, links):
    """Heat flow into the owned rows first : end from the pairs of their block [W] added to flow, and how many touch
    added to links (n,). Pairs are worked through in the order of the list."""
    for k in range(len(row)):
        i, j = row[k], partner[k]
        reach = hot[i, RADIUS] + hot[j, RADIUS]
        dx, dy = hot[j, X] - hot[i, X], hot[j, Y] - hot[i, Y]
        if dx * dx + dy * dy > reach * reach:
            continue
        heat = conductance * (temperature[j] - temperature[i])
        if first <= i < end:
            flow[i] += heat
            links[i] += 1
        if first <= j < end:
            flow[j] -= heat
            links[j] += 1
