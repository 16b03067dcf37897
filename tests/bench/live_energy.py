"""Fits the tables by which the live group conserves energy: ./dev bench live_energy

They are addon/nodes/live_energy.py's, whose docstring tells their form; they are printed as they
stand there. The figures below each are how much more or less than the Specular Color a white world
shows with Conserve Energy, by quadrature, for the table in use: for view angles up to 85 degrees
and above, and with Fresnel, where the colour times R_F at the view angle is what is aimed at.
"""

import numpy as np
from lobefit import _native
from lobefit_addon.nodes.live_energy import SINCE_5_0, UNTIL_4_5, Table

POINTS_VIEW, POINTS_LOBE, RANK, POWERS = 25, 13, 3, 3
ROUNDS = 80
# The columns of lobefit._native.live_albedo.
IN_USE = {"UNTIL_4_5": (0, UNTIL_4_5), "SINCE_5_0": (1, SINCE_5_0)}
GRAZING = np.cos(np.radians(86))


def hats(values: np.ndarray, count: int) -> np.ndarray:
    """What each of `count` equidistant points in [0, 1] counts for at each value: (N, count)."""
    place = np.clip(values, 0, 1) * (count - 1)
    return np.maximum(1 - np.abs(place[:, None] - np.arange(count)), 0)


def samples(release: int) -> tuple[np.ndarray, ...]:
    """Coordinates e, wide and y, the cosine and ln of what masking leaves, on a grid."""
    share, views = np.linspace(0, 1, 41), np.linspace(0, 1, 73)
    # Denser in narrow lobes, where the share of the broad closure changes fastest.
    wide, e, y = np.meshgrid(share**2 * (2 - share), views, np.linspace(0, 1, 9), indexing="ij")
    wide, e, y = np.maximum(wide.ravel(), 1e-5), np.minimum(e.ravel(), 0.9995), y.ravel()
    exponent = 1 / wide - 1
    cosine = np.maximum(1 / np.sqrt(1 + e**2 * (exponent + 2) / (1 - e**2)), 1e-3)
    ratio2 = ((1 - y) / cosine) ** 2  # (1 - alpha) / (alpha + (1 - alpha) cos^2)
    alpha = np.clip((1 - (1 - y) ** 2) / (1 - (1 - y) ** 2 + ratio2), 0, 1)
    return e, wide, y, cosine, np.log(masking(release, cosine, exponent, alpha))


def rows(*columns: np.ndarray | float) -> np.ndarray:
    return np.stack(np.broadcast_arrays(*columns), -1).reshape(-1, len(columns))


def masking(release: int, cosine, exponent, alpha, ior=1.0, fresnel=0.0) -> np.ndarray:
    columns = _native.live_albedo(rows(cosine, exponent, alpha, ior, fresnel)).T
    return columns[release] / columns[2]


def fit(release: int) -> tuple[np.ndarray, np.ndarray]:
    """A table's by_view and by_lobe by alternating least squares, reweighted for the worst."""
    e, wide, y, cosine, log_masking = samples(release)
    view, lobe, powers = hats(e, POINTS_VIEW), hats(wide, POINTS_LOBE), y[:, None] ** range(POWERS)
    # Beyond GRAZING, and for exponents below 1, it matters less.
    importance = np.where(cosine >= GRAZING, 1, 0.05) * np.where(wide <= 0.55, 1, 0.25)
    weight, least = importance.copy(), np.inf
    by_view = np.linspace(0, 1, POINTS_VIEW)[:, None] ** range(RANK)

    def solve(columns: np.ndarray) -> np.ndarray:
        weighted = columns * weight[:, None]
        # A little damping settles points that no sample comes near.
        damped = weighted.T @ weighted + 1e-7 * np.eye(columns.shape[1])
        return np.linalg.solve(damped, weighted.T @ (log_masking * weight))

    for step in range(ROUNDS):
        columns = np.einsum("nq,nk,nr->nqkr", powers, lobe, view @ by_view)
        by_lobe = solve(columns.reshape(len(e), -1)).reshape(POWERS, POINTS_LOBE, RANK)
        factors = np.einsum("nq,nk,qkr->nr", powers, lobe, by_lobe, optimize=True)
        columns = (view[:, :, None] * factors[:, None]).reshape(len(e), -1)
        by_view = solve(columns).reshape(POINTS_VIEW, RANK)
        off = np.abs(columns @ by_view.ravel() - log_masking) * importance
        if off.max() < least:
            least, best = off.max(), (by_view, by_lobe)
        if step > 5:
            weight *= (1 + off / off.max()) ** 0.35
            weight = np.minimum(weight / weight.mean(), 8)
    by_view, by_lobe = best
    # Of the many ways to share a factor between the two, the one with orthogonal curves up to 1.
    orthogonal, mixing = np.linalg.qr(by_view)
    scale = np.abs(orthogonal).max(0)
    return orthogonal / scale, by_lobe @ mixing.T * scale


def tabulated(table: Table, cosine, exponent, alpha) -> np.ndarray:
    """What the group's nodes compute from a table."""
    tan2 = 1 / cosine**2 - 1
    e, wide = np.sqrt(tan2 / (tan2 + exponent + 2)), 1 / (exponent + 1)
    y = 1 - cosine * np.sqrt((1 - alpha) / (alpha + (1 - alpha) * cosine**2))
    by_lobe = [hats(wide, len(points)) @ np.array(points) for points in table.by_lobe]
    factors = sum(y[:, None] ** power * each for power, each in enumerate(by_lobe))
    return np.exp((factors * (hats(e, len(table.by_view)) @ np.array(table.by_view))).sum(1))


def deviation(
    release: int,
    table: Table,
    angles: np.ndarray,
    exponents: np.ndarray,
    ior: float = 1.0,
    fresnel: float = 0.0,
) -> tuple[float, float]:
    """The least and the greatest of the ratio of what is shown to what is aimed at, less 1."""
    grid = np.meshgrid(
        np.cos(np.radians(angles)), exponents, np.linspace(0, 1, 21) ** 2, indexing="ij"
    )
    lobes = [each.ravel() for each in grid]
    ratio = masking(release, *lobes, ior, fresnel) / tabulated(table, *lobes)
    return ratio.min() - 1, ratio.max() - 1


def printed(points: np.ndarray, indent: str) -> str:
    lines = "".join(f"{indent}    ({', '.join(f'{x:.4f}' for x in point)}),\n" for point in points)
    return f"(\n{lines}{indent}),\n"


def main() -> None:
    below, above = np.linspace(0, 85, 35), np.linspace(85, 89.9, 20)
    narrow, wide = np.geomspace(1, 1e5, 41), np.linspace(0, 1, 11)
    for name, (release, table) in IN_USE.items():
        by_view, by_lobe = fit(release)
        lobe = "".join(" " * 8 + printed(points, " " * 8) for points in by_lobe)
        print(f"{name} = Table(\n    by_view={printed(by_view, '    ')}", end="")
        print(f"    by_lobe=(\n{lobe}    ),\n)\n")
        for title, angles, exponents, *glass in (
            ("to 85 degrees, exponents of 1 and above", below, narrow),
            ("to 85 degrees, exponents below 1", below, wide),
            ("beyond, any exponent", above, np.append(wide, narrow)),
            ("Fresnel of 1.5, to 85 degrees, exponents of 1 and above", below, narrow, 1.5, 1.0),
            ("Fresnel of 3, to 85 degrees, exponents of 1 and above", below, narrow, 3.0, 1.0),
        ):
            least, most = deviation(release, table, angles, exponents, *glass)
            print(f"# {title}: {least:+.2%} to {most:+.2%}")
        print()


if __name__ == "__main__":
    main()
