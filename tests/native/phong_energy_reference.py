"""Makes phong_energy_reference.inc, what the integrals of phong_energy.h and their derivatives are.

    python tests/native/phong_energy_reference.py     (minutes; needs mpmath, of the extra `test`)

Each integral is a quadrature by rings about the mirror direction, with 45 digits, and knows nothing
of the closed forms; the derivatives are central differences of such quadratures. Of a ring at the
angle a from the mirror direction, which is theta from the normal, the part is above the horizon
where cos theta cos a + sin theta sin a cos phi > 0, which is |phi| < acos(-cot theta cot a).
"""

from itertools import product
from multiprocessing import Pool
from pathlib import Path

from mpmath import mp, mpf

mp.dps = 45
# The lobe is below 1e-48 of its peak beyond the last, in units of 1 / sqrt(exponent + 1).
RINGS = (0, 0.25, 1, 2, 3.5, 5, 7, 9, 12, 15)
STEP = mpf("1e-16")
EXPONENTS = (
    *(0.0, 1e-37, 1e-9, 1e-3, 0.3, 1.0, 2.0, 4.7, 11.0, 18.9, 19.5),
    *(20.0, 50.0, 1234.5, 1e5, 1e8, 1e12),
)
ANGLES = (0.0, 1e-5, 3.0, 30.0, 44.999, 45.001, 70.0, 85.0, 89.0, 89.9, 89.9999, 89.9999999, 90.0)


def integrals(exponent, theta):
    """Phong's and modified Phong's, for numbers of mpmath; theta in radians."""
    c, s = mp.cos(theta), mp.sin(theta)

    def ring(a):
        ca, sa = mp.cos(a), mp.sin(a)
        # About the normal, or of no width, all of a ring is above the horizon.
        cut = c * ca / (s * sa) if s * sa > 0 else mpf(1)
        half = mp.acos(-min(max(cut, -1), 1))
        power = ca**exponent * sa
        mean = c * ca * half + s * sa * mp.sin(half)
        return mp.matrix([2 * power * half, 2 * power * mean])

    ends = [mpf(end) / mp.sqrt(exponent + 1) for end in RINGS]
    last = min(ends[-1], mp.pi / 2)
    kink = abs(mp.pi / 2 - theta)
    between = sorted({end for end in [*ends, kink] if 0 < end < last})
    ends = [mpf(0), *between, last]
    return [mp.quad(lambda a, k=k: ring(a)[k], ends) for k in range(2)]


def differences(exponent, theta, by_exponent, by_theta):
    """Central differences of both integrals, whose errors are of the order of STEP squared."""
    above = integrals(exponent + by_exponent, theta + by_theta)
    below = integrals(exponent - by_exponent, theta - by_theta)
    return [(a - b) / (2 * (by_exponent + by_theta)) for a, b in zip(above, below, strict=True)]


def rows(case):
    """A row of each integral for an exponent and an angle in degrees, both as doubles."""
    exponent, angle = case
    n, theta = mpf(exponent), mp.radians(mpf(angle))
    values = integrals(n, theta)
    by_exponent = differences(n, theta, STEP * (n + 1), 0)
    # There is nothing below an angle of 0.
    by_angle = differences(n, theta, 0, STEP) if angle > 0 else [mp.nan] * 2
    columns = zip(("false", "true"), values, by_exponent, by_angle, strict=True)
    return "".join(
        f"{{{modified}, {exponent!r}, {angle!r}, {', '.join(map(as_literal, figures))}}},\n"
        for modified, *figures in columns
    )


def as_literal(figure):
    return "NAN" if mp.isnan(figure) else mp.nstr(figure, 30)


def main():
    with Pool() as pool:
        lines = pool.map(rows, product(EXPONENTS, ANGLES), chunksize=4)
    path = Path(__file__).with_suffix(".inc")
    head = f"// Made by {Path(__file__).name}.\n// clang-format off\n"
    path.write_text(head + "".join(lines))


if __name__ == "__main__":
    main()
