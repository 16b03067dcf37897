"""How much of their weight the live group's closures reflect: a small table, and its nodes.

Cycles' masking takes a part of every wide closure, and of narrow ones at grazing angles. What is
left of the sum of both weights, seen at theta, is

    exp(sum_r A_r(e) (M_0r(w) + y M_1r(w) + y^2 M_2r(w))),  r = 1, 2, 3,

    e = sin theta / sqrt(sin^2 theta + (s + 2) cos^2 theta),    w = 1 / (s + 1),
    y = 1 - cos theta sqrt((1 - alpha) / (alpha + (1 - alpha) cos^2 theta)),

where e, w and y run from 0 to 1 and all is smooth. The curves A (`BY_VIEW`) and M (`BY_LOBE`) go in
straight lines through equidistant points, which were fitted to quadratures of the closures without
Fresnel, as Cycles samples them (`./dev bench live_energy`): a table, and no closed form. It is
within 0.7 % up to 85 degrees for exponents from 1 up and within 2 % below 1; nearer to the horizon
the closures reflect 8 % less to 2 % more than it tells.
"""

from .tree import NodeFormulas, Scalar, Vector

BY_VIEW = (
    (-0.9688, -0.9485, -0.3029),
    (-0.9690, -0.9439, -0.2959),
    (-0.9691, -0.9283, -0.2736),
    (-0.9671, -0.8993, -0.2298),
    (-0.9616, -0.8531, -0.1685),
    (-0.9552, -0.7881, -0.0984),
    (-0.9502, -0.7068, -0.0194),
    (-0.9462, -0.6161, 0.0660),
    (-0.9438, -0.5154, 0.1493),
    (-0.9428, -0.4028, 0.2243),
    (-0.9428, -0.2793, 0.2838),
    (-0.9430, -0.1472, 0.3300),
    (-0.9454, -0.0115, 0.3539),
    (-0.9519, 0.1288, 0.3638),
    (-0.9617, 0.2720, 0.3640),
    (-0.9727, 0.4135, 0.3562),
    (-0.9778, 0.5495, 0.3525),
    (-0.9894, 0.6746, 0.2842),
    (-1.0000, 0.7858, 0.1798),
    (-0.9972, 0.8860, 0.0909),
    (-0.9924, 0.9598, -0.0450),
    (-0.9725, 1.0000, -0.1994),
    (-0.9479, 0.9829, -0.4258),
    (-0.8725, 0.8729, -0.6452),
    (-0.7201, 0.5982, -1.0000),
)
BY_LOBE = (
    (
        (0.0447, -0.0646, 0.0672),
        (0.0575, -0.0733, 0.0276),
        (0.0665, -0.0742, 0.0033),
        (0.0764, -0.0718, -0.0206),
        (0.0882, -0.0661, -0.0343),
        (0.1017, -0.0556, -0.0433),
        (0.1172, -0.0402, -0.0489),
        (0.1353, -0.0214, -0.0501),
        (0.1586, 0.0041, -0.0474),
        (0.1873, 0.0356, -0.0449),
        (0.2273, 0.0790, -0.0419),
        (0.2814, 0.1384, -0.0396),
        (0.3711, 0.2314, -0.0463),
    ),
    (
        (-0.0315, 0.0422, -0.0117),
        (-0.0352, 0.0432, 0.0700),
        (-0.0369, 0.0366, 0.0768),
        (-0.0385, 0.0317, 0.0873),
        (-0.0396, 0.0320, 0.0967),
        (-0.0386, 0.0272, 0.0963),
        (-0.0358, 0.0206, 0.0947),
        (-0.0342, 0.0141, 0.0853),
        (-0.0333, 0.0084, 0.0666),
        (-0.0342, 0.0012, 0.0612),
        (-0.0349, -0.0064, 0.0451),
        (-0.0353, -0.0125, 0.0193),
        (-0.0251, -0.0221, -0.0149),
    ),
    (
        (0.0053, -0.0026, -0.0386),
        (0.0032, 0.0007, -0.0992),
        (0.0032, 0.0067, -0.0906),
        (0.0042, 0.0109, -0.0843),
        (0.0050, 0.0082, -0.0887),
        (0.0049, 0.0097, -0.0846),
        (0.0040, 0.0118, -0.0798),
        (0.0046, 0.0132, -0.0690),
        (0.0061, 0.0126, -0.0511),
        (0.0088, 0.0128, -0.0418),
        (0.0116, 0.0124, -0.0231),
        (0.0151, 0.0096, 0.0049),
        (0.0148, 0.0069, 0.0267),
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
    constant, linear, quadratic = (
        _curves(formulas, f"M{power}", wide, points) for power, points in enumerate(BY_LOBE)
    )
    factors = quadratic.times_plus(y, linear).times_plus(y, constant).named("M")
    return _curves(formulas, "A", e, BY_VIEW).dot(factors).exp().named("masking")


def _curves(
    formulas: NodeFormulas, label: str, place: Scalar, points: tuple[tuple[float, ...], ...]
) -> Vector:
    """Three curves through equidistant points from 0 to 1, seen at `place`."""
    last = len(points) - 1
    curves = [
        [(k / last, value) for k, value in enumerate(row)] for row in zip(*points, strict=True)
    ]
    return formulas.rgb_curves(label, place, curves)
