"""Plain Python: two names, all lines, and 2 by 2 matrices inverted by hand."""

import math


def recognize(z, Q, hs, Hs, Sigma, g, newness):
    """Try both names of the observation with every line, and invert 2 by 2 matrices by hand."""
    least, best = math.inf, -1
    for j in range(hs.shape[1]):
        S = Hs[j] @ Sigma @ Hs[j].T
        for side in (1.0, -1.0):
            a = math.remainder(float(z[0]) + (math.pi if side < 0 else 0.0) - float(hs[0, j]), 2 * math.pi)
            d = side * float(z[1]) - float(hs[1, j])
            saa, sar, srr = S[0, 0] + Q[0, 0], S[0, 1] + side * Q[0, 1], S[1, 1] + Q[1, 1]
            d2 = (srr * a * a - 2 * sar * a * d + saa * d * d) / (saa * srr - sar * sar)
            if d2 < least:
                least, best = d2, j
    if least < g * g:
        return best
    return -2 if least < newness * newness else -1
