"""Student's t: how many standard deviations 95 % take where the deviation itself comes from few observations."""

from __future__ import annotations


def two_sided_95(freedom: int) -> float:
    """The 97.5 % point of Student's distribution, 1.96 for many degrees of freedom, 2.31 for 8, 4.1 for 2.

    The expansion of Cornish and Fisher (Abramowitz and Stegun, 26.7.5): right to 1 % from 3 degrees on, 5 % at 2.
    """
    z = 1.959964
    first = (z**3 + z) / 4
    second = (5 * z**5 + 16 * z**3 + 3 * z) / 96
    third = (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384
    fourth = (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / 92160
    return z + first / freedom + second / freedom**2 + third / freedom**3 + fourth / freedom**4
