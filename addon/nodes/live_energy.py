"""How much of their weight the live group's closures reflect: small tables, and their nodes.

Cycles' masking takes a part of every wide closure, and of narrow ones at grazing angles. What is
left of the sum of both weights, seen at theta, is

    exp(sum_r A_r(e) (M_0r(w) + y M_1r(w) + y^2 M_2r(w))),  r = 1, 2, 3,

    e = sin theta / sqrt(sin^2 theta + (s + 2) cos^2 theta),    w = 1 / (s + 1),
    y = 1 - cos theta sqrt((1 - alpha) / (alpha + (1 - alpha) cos^2 theta)),

where e, w and y run from 0 to 1 and all is smooth. The curves A (`by_view`) and M (`by_lobe`) go in
straight lines through equidistant points, which were fitted to quadratures of the closures without
Fresnel (`./dev bench live_energy`): tables, and no closed form. They are within 0.8 % up to 85
degrees for exponents from 1 up and within 2.2 % below 1; nearer to the horizon the closures reflect
12 % less to 2.4 % more than they tell.

There are two, because until Blender 4.5 Cycles also takes light from between the horizon of the
surface and that of a bent closure (native/closures/live_lobe.h). A group keeps the table of the
release that made it; the other's is off by up to 3 % at 85 degrees.
"""

from typing import NamedTuple

import bpy

from .tree import NodeFormulas, Scalar, Vector

Points = tuple[tuple[float, float, float], ...]


class Table(NamedTuple):
    """Three curves A, and for each power of y three curves M."""

    by_view: Points
    by_lobe: tuple[Points, Points, Points]


UNTIL_4_5 = Table(
    by_view=(
        (-0.9684, -0.9363, -0.3270),
        (-0.9687, -0.9319, -0.3194),
        (-0.9696, -0.9175, -0.2952),
        (-0.9692, -0.8910, -0.2485),
        (-0.9653, -0.8476, -0.1824),
        (-0.9595, -0.7841, -0.1072),
        (-0.9552, -0.7040, -0.0222),
        (-0.9526, -0.6153, 0.0697),
        (-0.9512, -0.5164, 0.1600),
        (-0.9507, -0.4049, 0.2416),
        (-0.9509, -0.2823, 0.3061),
        (-0.9509, -0.1508, 0.3557),
        (-0.9527, -0.0152, 0.3813),
        (-0.9584, 0.1253, 0.3919),
        (-0.9670, 0.2690, 0.3924),
        (-0.9761, 0.4122, 0.3850),
        (-0.9786, 0.5520, 0.3832),
        (-0.9894, 0.6780, 0.3098),
        (-1.0000, 0.7886, 0.1932),
        (-0.9962, 0.8890, 0.0949),
        (-0.9913, 0.9615, -0.0549),
        (-0.9719, 1.0000, -0.2262),
        (-0.9522, 0.9741, -0.4765),
        (-0.8840, 0.8586, -0.7312),
        (-0.7133, 0.5817, -1.0000),
    ),
    by_lobe=(
        (
            (0.0442, -0.0646, 0.0619),
            (0.0572, -0.0737, 0.0253),
            (0.0662, -0.0748, 0.0034),
            (0.0762, -0.0725, -0.0187),
            (0.0879, -0.0667, -0.0316),
            (0.1014, -0.0561, -0.0396),
            (0.1168, -0.0407, -0.0444),
            (0.1349, -0.0219, -0.0460),
            (0.1582, 0.0038, -0.0435),
            (0.1867, 0.0355, -0.0411),
            (0.2266, 0.0792, -0.0386),
            (0.2803, 0.1388, -0.0371),
            (0.3701, 0.2325, -0.0439),
        ),
        (
            (-0.0311, 0.0421, -0.0120),
            (-0.0354, 0.0447, 0.0634),
            (-0.0373, 0.0384, 0.0717),
            (-0.0389, 0.0333, 0.0830),
            (-0.0397, 0.0328, 0.0899),
            (-0.0387, 0.0281, 0.0881),
            (-0.0360, 0.0216, 0.0856),
            (-0.0343, 0.0153, 0.0780),
            (-0.0333, 0.0085, 0.0610),
            (-0.0342, 0.0014, 0.0559),
            (-0.0349, -0.0062, 0.0410),
            (-0.0351, -0.0129, 0.0179),
            (-0.0249, -0.0225, -0.0140),
        ),
        (
            (0.0050, -0.0023, -0.0376),
            (0.0037, -0.0007, -0.0897),
            (0.0036, 0.0053, -0.0846),
            (0.0048, 0.0097, -0.0803),
            (0.0053, 0.0077, -0.0823),
            (0.0051, 0.0092, -0.0775),
            (0.0044, 0.0112, -0.0724),
            (0.0049, 0.0123, -0.0635),
            (0.0061, 0.0126, -0.0469),
            (0.0089, 0.0127, -0.0382),
            (0.0117, 0.0124, -0.0209),
            (0.0149, 0.0099, 0.0051),
            (0.0147, 0.0073, 0.0251),
        ),
    ),
)

SINCE_5_0 = Table(
    by_view=(
        (-0.9727, -0.9468, -0.2960),
        (-0.9731, -0.9425, -0.2899),
        (-0.9744, -0.9281, -0.2701),
        (-0.9749, -0.9015, -0.2312),
        (-0.9728, -0.8582, -0.1745),
        (-0.9682, -0.7952, -0.1065),
        (-0.9647, -0.7154, -0.0291),
        (-0.9631, -0.6258, 0.0550),
        (-0.9625, -0.5255, 0.1398),
        (-0.9623, -0.4127, 0.2186),
        (-0.9622, -0.2885, 0.2847),
        (-0.9615, -0.1552, 0.3375),
        (-0.9622, -0.0183, 0.3676),
        (-0.9661, 0.1236, 0.3831),
        (-0.9723, 0.2683, 0.3892),
        (-0.9799, 0.4121, 0.3860),
        (-0.9837, 0.5524, 0.3795),
        (-0.9930, 0.6780, 0.3114),
        (-1.0000, 0.7893, 0.2123),
        (-0.9969, 0.8891, 0.1140),
        (-0.9913, 0.9616, -0.0259),
        (-0.9748, 1.0000, -0.1949),
        (-0.9616, 0.9735, -0.4435),
        (-0.9137, 0.8715, -0.7256),
        (-0.8206, 0.6450, -1.0000),
    ),
    by_lobe=(
        (
            (0.0554, -0.0810, 0.0858),
            (0.0642, -0.0835, 0.0361),
            (0.0716, -0.0819, 0.0087),
            (0.0806, -0.0782, -0.0165),
            (0.0919, -0.0718, -0.0304),
            (0.1053, -0.0612, -0.0385),
            (0.1207, -0.0461, -0.0429),
            (0.1386, -0.0276, -0.0435),
            (0.1618, -0.0027, -0.0394),
            (0.1899, 0.0287, -0.0361),
            (0.2289, 0.0722, -0.0321),
            (0.2810, 0.1323, -0.0321),
            (0.3688, 0.2262, -0.0395),
        ),
        (
            (-0.0383, 0.0524, -0.0225),
            (-0.0386, 0.0494, 0.0704),
            (-0.0387, 0.0398, 0.0745),
            (-0.0387, 0.0343, 0.0912),
            (-0.0389, 0.0329, 0.0951),
            (-0.0372, 0.0275, 0.0926),
            (-0.0338, 0.0203, 0.0895),
            (-0.0317, 0.0135, 0.0810),
            (-0.0311, 0.0076, 0.0612),
            (-0.0316, 0.0003, 0.0554),
            (-0.0325, -0.0070, 0.0391),
            (-0.0335, -0.0127, 0.0102),
            (-0.0242, -0.0215, -0.0240),
        ),
        (
            (0.0061, -0.0037, -0.0420),
            (0.0040, -0.0011, -0.1031),
            (0.0032, 0.0063, -0.0910),
            (0.0036, 0.0101, -0.0908),
            (0.0041, 0.0086, -0.0898),
            (0.0037, 0.0103, -0.0847),
            (0.0027, 0.0126, -0.0791),
            (0.0034, 0.0137, -0.0694),
            (0.0056, 0.0124, -0.0504),
            (0.0088, 0.0116, -0.0398),
            (0.0125, 0.0100, -0.0190),
            (0.0172, 0.0053, 0.0164),
            (0.0171, 0.0028, 0.0386),
        ),
    ),
)


def masking(
    formulas: NodeFormulas, cosine: Scalar, tan2: Scalar, exponent: Scalar, interpolation: Scalar
) -> Scalar:
    """What is left, by three RGB Curve nodes of w, one of e and some arithmetic."""
    e = (tan2 / (tan2 + (exponent + 2))).sqrt().named("e")
    wide = (1 / (exponent + 1)).named("wide")
    rest = 1 - interpolation
    y = (1 - cosine * (rest / (rest * (cosine * cosine) + interpolation)).sqrt()).named("y")
    table = SINCE_5_0 if bpy.app.version >= (5, 0) else UNTIL_4_5
    constant, linear, quadratic = (
        _curves(formulas, f"M{power}", wide, points) for power, points in enumerate(table.by_lobe)
    )
    factors = quadratic.times_plus(y, linear).times_plus(y, constant).named("M")
    return _curves(formulas, "A", e, table.by_view).dot(factors).exp().named("masking")


def _curves(formulas: NodeFormulas, label: str, place: Scalar, points: Points) -> Vector:
    """Three curves through equidistant points from 0 to 1, seen at `place`."""
    last = len(points) - 1
    curves = [
        [(k / last, value) for k, value in enumerate(row)] for row in zip(*points, strict=True)
    ]
    return formulas.rgb_curves(label, place, curves)
