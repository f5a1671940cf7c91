"""V17: a ball is launched sliding, without spin, on a level floor (the billiard ball of Coriolis 1835).

While it slides, v' = -mu g and R w' = mu g m R^2 / I; it rolls once v = R w:

    t = v0 / (mu g (1 + m R^2 / I)),   v = v0 / (1 + I / (m R^2))
    sphere I = 2/5 m R^2: t = 2 v0 / (7 mu g), v = 5/7 v0;   disk I = m R^2 / 2: t = v0 / (3 mu g), v = 2/3 v0

Friction acts at the contact point, so m v l + I w (sense of rolling) keeps its value m v0 l at all times, l = R - U/2.
Numbers: v0 = 20 m/s, mu = 0.3: 1.943 s and 2.268 s.
"""

from __future__ import annotations

GRAVITY, RADIUS, DENSITY, MU, V0 = 9.8, 1.0, 1000.0, 0.3, 20.0
FINAL = {"off": 5.0 / 7.0 * V0, "on": 2.0 / 3.0 * V0}
TIME = {"off": 2.0 * V0 / (7.0 * MU * GRAVITY), "on": V0 / (3.0 * MU * GRAVITY)}
