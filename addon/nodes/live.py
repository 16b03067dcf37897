"""The node group 'Lobefit Live': the interpolated lobe in closed form, every parameter a socket.

A Beckmann closure with a bent normal, a broad one that fills in where the lobe is wide, and a
diffuse one. With Conserve Energy the two reflect at every view angle, before Fresnel, what they
reflect at normal incidence otherwise; at 0, as files of version 2 have it, nothing of that is
computed. The formulas are derived in native/closures/live_lobe.h, and
native/closures/live_lobe.cpp computes the same in C++ with the same names, so that previews need no
rendering.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import bpy

from .live_energy import masking
from .tree import NodeFormulas, Scalar, Vector, versioned_group

NAME = "Lobefit Live"
# Saved with the group: to be raised with any change of the formulas.
VERSION = 3
VERSION_KEY = "lobefit_version"

# Sharper lobes are drawn as this one, with the same albedo: single precision loses their peak.
EXPONENT_LIMIT = 1e5
# Added to the tangent: at normal incidence nothing else is left of it, and Cycles makes NaN of a
# tangent along the normal. Its direction is one that no modelled surface faces.
TINY_TANGENT = (3.7e-7, 5.9e-7, 7.1e-7)
# The same numbers, fitted to the formula of the lobe, as `Correction` in live_lobe.cpp.
TILT_Z, TILT_ZU, TILT_UU, TILT_RISE = 2.53, -2.21, -0.398, -5.28
BOTH, BOTH_WIDE, BOTH_ALPHA = 0.482, 0.741, -0.342
X_Z, X_ZWIDE, X_PHI, X_PHI2 = 6.34, -9.81, -1.21, 0.888
Y_Z, Y_ZZ = 2.56, 10.6
WEIGHT_ZZ, WEIGHT_WIDE, WEIGHT_ALPHA = -27.2, -0.426, -0.115
WEIGHT_PHI2, WEIGHT_RISE = 0.223, -1.49
BROAD_WIDE = 1.11
BROAD_X_Z, BROAD_X_ZZ, BROAD_X_RISE = -2.12, 6.95, 1.9
BROAD_Y_ALPHA, BROAD_Y_PHI2 = 1.79, -0.975
SHARE, SHARE_WIDE, SHARE_RISE = -1.95, 0.958, -1.28
SHARE_Z, SHARE_ZZ, SHARE_ZPHI = 6.78, -15.0, -2.18
SHARE_END = 0.004
LEAST_PULL = 0.05


def normal_albedo(exponent: Any, interpolation: Any) -> Any:
    """The albedo at normal incidence of the lobe with k_s = 1 and no Fresnel.

    It takes numbers or node values alike: a record's k_s is multiplied by what the group divides
    by. Exact for interpolation 0, within 0.15 % otherwise.
    """
    s = exponent
    blinn = interpolation * s * (s * 0.5 + 1.19) / (s * (s + 3.41) + 5.02)
    return 2 * math.pi / (s + 2 - blinn)


def live_inputs(parameters: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The group's inputs that show a record's parameters: one instance for each exponent in use.

    The shaders of the instances are to be added. With shared channels there is one; with separate
    channels each instance has the colours of the channels of its exponent and black elsewhere.
    """
    exponents, specular, interpolation = _interpolated(parameters)
    albedo = [k * normal_albedo(s, interpolation) for k, s in zip(specular, exponents, strict=True)]
    ior = parameters["ior"]
    instances = []
    for exponent in dict.fromkeys(exponents):
        mask = [float(s == exponent) for s in exponents]
        strength = max(a * m for a, m in zip(albedo, mask, strict=True))
        scale = 1 / strength if strength > 0 else 1.0
        instances.append(
            {
                "Base Color": [d * m for d, m in zip(parameters["diffuse"], mask, strict=True)],
                "Specular Color": [a * m * scale for a, m in zip(albedo, mask, strict=True)],
                "Specular Strength": strength,
                "Exponent": exponent,
                "Interpolation": interpolation,
                "IOR": 1.5 if ior is None else ior,
                "Fresnel": 0.0 if ior is None else 1.0,
            }
        )
    return instances


def _interpolated(parameters: Mapping[str, Any]) -> tuple[list[float], list[float], float]:
    """Exponents, k_s and interpolation of any of the three models (Nielsen et al., eq. 1 to 3)."""
    exponent, specular = parameters["exponent"], parameters["specular"]
    exponents = [exponent] * 3 if isinstance(exponent, int | float) else list(exponent)
    pairs = list(zip(specular, exponents, strict=True))
    match parameters["model"]:
        case "modified-phong":
            return exponents, [rho * (s + 2) / (2 * math.pi) for rho, s in pairs], 0.0
        case "modified-blinn-phong":
            scaled = [rho * (s + 8) / (8 * math.pi) for rho, s in pairs]
            return [s / 4 for s in exponents], scaled, 1.0
    return exponents, list(specular), parameters["interpolation"]


def live_group() -> bpy.types.ShaderNodeTree:
    """The group of this version in this file, made if it is not there yet."""
    return versioned_group(NAME, VERSION_KEY, VERSION, _fill)


def _fill(group: bpy.types.ShaderNodeTree) -> None:
    _add_sockets(group)
    _add_nodes(NodeFormulas(group))


def _add_sockets(group: bpy.types.ShaderNodeTree) -> None:
    def add(name: str, kind: str, default: Any, low: float = 0.0, high: float = 1.0) -> None:
        socket = group.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
        if kind == "Float":
            socket.min_value, socket.max_value = low, high
        if kind == "Float" and high == 1.0:
            socket.subtype = "FACTOR"
        socket.default_value = default

    add("Base Color", "Color", (0.2, 0.2, 0.2, 1.0))
    add("Specular Color", "Color", (1.0, 1.0, 1.0, 1.0))
    add("Specular Strength", "Float", 1.0, high=1e9)
    add("Exponent", "Float", 50.0, high=1e9)
    add("Interpolation", "Float", 0.5)
    add("IOR", "Float", 1.5, low=1.0, high=1e3)
    add("Fresnel", "Float", 1.0)
    normal = group.interface.new_socket("Normal", in_out="INPUT", socket_type="NodeSocketVector")
    normal.hide_value = True
    group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    # Last, so that the sockets before it have the identifiers of version 1.
    add("Conserve Energy", "Float", 0.0)


class _Inputs(NamedTuple):
    base_color: Vector
    specular_color: Vector
    strength: Scalar
    exponent: Scalar
    interpolation: Scalar
    ior: Scalar
    fresnel: Scalar
    normal: Vector
    conserve: Scalar


class _View(NamedTuple):
    tangent: Vector
    cosine: Scalar
    sine: Scalar
    sine2: Scalar
    tan: Scalar
    tan2: Scalar


class _Fresnel(NamedTuple):
    value: Scalar
    phi: Scalar
    rise: Scalar


class _Lobe(NamedTuple):
    """The lobe at the peak of its Phong relative, for k_s = 1: see live_lobe.h, step 1."""

    tan_tau: Scalar
    log_base: Scalar
    sec2_i: Scalar
    curvature: Scalar
    z: Scalar
    wide: Scalar
    wide_rise: Scalar


class _Closure(NamedTuple):
    """A Beckmann closure; its weight is 4 pi k_s F amount alpha2."""

    inverse_x2: Scalar
    inverse_y2: Scalar
    amount: Scalar
    normal: Vector

    @property
    def alpha2(self) -> Scalar:
        """alpha_x alpha_y."""
        return (self.inverse_x2 * self.inverse_y2).inverse_sqrt()


def _add_nodes(formulas: NodeFormulas) -> None:
    with formulas.frame("Inputs"):
        inputs = _inputs(formulas)
    with formulas.frame("View"):
        view = _view(formulas, inputs)
    with formulas.frame("Fresnel"):
        fresnel = _fresnel(inputs, view)
    with formulas.frame("Lobe at its peak"):
        lobe = _lobe(inputs, view, fresnel)
    with formulas.frame("Bent closure"):
        bent = _bent(inputs, view, lobe, fresnel)
    with formulas.frame("Broad closure"):
        broad = _broad(inputs, view, lobe, fresnel)
    with formulas.frame("Closures"):
        _shaders(formulas, inputs, view, fresnel, [bent, broad])
    formulas.tidy()


def _inputs(formulas: NodeFormulas) -> _Inputs:
    outputs = formulas.node("NodeGroupInput").outputs
    # An unconnected Normal arrives as zero; the Bump node makes it the surface's normal.
    bump = formulas.node("ShaderNodeBump", Normal=Vector(formulas, outputs["Normal"]))

    def scalar(name: str) -> Scalar:
        return Scalar(formulas, outputs[name])

    return _Inputs(
        base_color=Vector(formulas, outputs["Base Color"]),
        specular_color=Vector(formulas, outputs["Specular Color"]),
        strength=scalar("Specular Strength").at_least(0.0),
        exponent=scalar("Exponent").at_least(0.0).at_most(EXPONENT_LIMIT).named("s"),
        interpolation=scalar("Interpolation").at_least(0.0).at_most(1.0).named("alpha"),
        ior=scalar("IOR").at_least(1.0).named("eta"),
        fresnel=scalar("Fresnel").at_least(0.0).at_most(1.0),
        normal=Vector(formulas, bump.outputs["Normal"]).normalised().named("normal"),
        conserve=scalar("Conserve Energy").at_least(0.0).at_most(1.0),
    )


def _view(formulas: NodeFormulas, inputs: _Inputs) -> _View:
    incoming = Vector(formulas, formulas.node("ShaderNodeNewGeometry").outputs["Incoming"])
    cosine = incoming.dot(inputs.normal)
    across = incoming - inputs.normal * cosine
    cosine = cosine.at_least(1e-3).named("cos theta")
    sine = across.length().named("sin theta")
    tan = (sine / cosine).named("tan theta")
    return _View(
        tangent=(across + TINY_TANGENT).normalised().named("tangent"),
        cosine=cosine,
        sine=sine,
        sine2=(sine * sine).named("sin2 theta"),
        tan=tan,
        tan2=(tan * tan).named("tan2 theta"),
    )


def _fresnel(inputs: _Inputs, view: _View) -> _Fresnel:
    """R_F at the viewer's angle and what it does there: see live_lobe.h, step 4."""
    less, more = inputs.ior - 1, inputs.ior + 1
    excess = less * more
    v = excess * (view.tan2 + 1)
    d = v / ((v + 1).sqrt() + 1)
    rs = (d / (d + 2)).named("r_s")
    rp = ((d - excess) / (d + excess + 2)).named("r_p")
    s2, p2 = rs * rs, rp * rp

    def blended(reflectance: Scalar) -> Scalar:
        return (reflectance - 1) * inputs.fresnel + 1

    value = blended((s2 + p2) * 0.5).named("F")
    root = less / more
    facing = blended(root * root).named("F facing")
    slope = (rs * (1 - s2) + rp * (1 - p2)) * (v / (v + 1)) * (inputs.fresnel / value)
    return _Fresnel(
        value=value,
        phi=(slope * 0.25).named("phi"),
        rise=((value - facing) / (value + facing)).named("rise"),
    )


def _lobe(inputs: _Inputs, view: _View, fresnel: _Fresnel) -> _Lobe:
    s, alpha = inputs.exponent, inputs.interpolation
    pull = (1 - fresnel.phi).at_least(LEAST_PULL).named("pull")
    total = s + pull
    root = (total * total + s * pull * 4 * view.tan2).sqrt()
    x = (pull * view.tan * 2 / (total + root)).named("tan 2 tau")
    x2 = x * x
    y = (x / ((x2 + 1).sqrt() + 1)).named("tan tau")
    y2 = y * y
    e = (y2 / (y2 + 1)).named("sin2 tau")
    missing = (e * (2 - alpha * e)).named("1 - base")
    tan_i = s * x / pull
    tan2_i = tan_i * tan_i
    sec2_i = tan2_i + 1
    own = s * (x2 * (alpha * -0.75 + 1) + 1)
    curvature = ((pull * 0.5 + 0.5) * sec2_i + own).named("H")
    wide = (1 / (s + 1)).named("wide")
    return _Lobe(
        tan_tau=y,
        log_base=(missing * -2 / (2 - missing)).named("ln base"),
        sec2_i=sec2_i,
        curvature=curvature,
        z=(pull * tan2_i / curvature).named("z"),
        wide=wide,
        wide_rise=wide * fresnel.rise,
    )


def _bent(inputs: _Inputs, view: _View, lobe: _Lobe, fresnel: _Fresnel) -> _Closure:
    s, alpha, phi, z, wide = inputs.exponent, inputs.interpolation, fresnel.phi, lobe.z, lobe.wide
    wide_uu = wide * (view.sine2 * view.sine2)
    log_tilt = wide_uu * TILT_UU + lobe.wide_rise * TILT_RISE
    log_tilt = z * (view.sine2 * TILT_ZU + TILT_Z) + log_tilt
    tilt = (lobe.tan_tau * log_tilt.exp()).named("tan tilt")
    shrink = (tilt * tilt + 1).inverse_sqrt()
    c = ((view.sine * tilt + view.cosine) * shrink).named("c")
    c2 = c * c
    across = s * ((1 - alpha) * c2 + alpha) + (phi * (0.5 - c2) + c2)
    both = wide * (wide * BOTH_WIDE + (alpha * BOTH_ALPHA + BOTH))
    phi2 = phi * phi
    log_x = wide * (z * (wide * X_ZWIDE + X_Z) + phi * (wide * phi * X_PHI2 + X_PHI)) + both
    log_y = wide * z * (z * Y_ZZ + Y_Z) + both
    log_weight = wide * WEIGHT_WIDE + (alpha * WEIGHT_ALPHA + z * z * WEIGHT_ZZ)
    log_weight = phi2 * WEIGHT_PHI2 + (fresnel.rise * WEIGHT_RISE + log_weight)
    log_peak = s * lobe.log_base + phi * view.tan * (tilt * shrink) * -2 + wide * log_weight
    return _Closure(
        inverse_x2=(lobe.curvature * log_x.exp() * 2 + 1).named("1 / alpha_x^2"),
        inverse_y2=(across * log_y.exp() * 2 + 1).named("1 / alpha_y^2"),
        amount=(c * log_peak.exp() * lobe.sec2_i.inverse_sqrt()).named("amount"),
        normal=(view.tangent * tilt + inputs.normal).named("bent normal"),
    )


def _broad(inputs: _Inputs, view: _View, lobe: _Lobe, fresnel: _Fresnel) -> _Closure:
    s, alpha, phi, z, wide = inputs.exponent, inputs.interpolation, fresnel.phi, lobe.z, lobe.wide
    both = wide * wide * BROAD_WIDE
    log_x = z * (z * BROAD_X_ZZ + BROAD_X_Z) + (lobe.wide_rise * BROAD_X_RISE + both)
    log_y = phi * phi * BROAD_Y_PHI2 + (alpha * z * BROAD_Y_ALPHA + both)
    across = s * ((alpha - 1) * view.sine2 + 1)
    log_share = z * (wide * z * SHARE_ZZ + (phi * SHARE_ZPHI + SHARE_Z))
    log_share = lobe.wide_rise * SHARE_RISE + (wide * SHARE_WIDE + SHARE) + log_share
    share = (wide * log_share.exp() + -SHARE_END).at_least(0.0).named("share")
    return _Closure(
        inverse_x2=(s * log_x.exp() + 1).named("1 / alpha_x^2"),
        inverse_y2=(across * log_y.exp() + 1).named("1 / alpha_y^2"),
        amount=(view.cosine * share).named("amount"),
        normal=inputs.normal,
    )


def _shaders(
    formulas: NodeFormulas,
    inputs: _Inputs,
    view: _View,
    fresnel: _Fresnel,
    closures: list[_Closure],
) -> None:
    strength = _strength(formulas, inputs, view, closures) * fresnel.value
    links = formulas.tree.links
    total = formulas.node("ShaderNodeBsdfDiffuse", Color=inputs.base_color, Normal=inputs.normal)
    for closure in closures:
        # Cycles takes sqrt(alpha) as roughness, and the ratio of the two alphas as anisotropy.
        alpha2 = closure.alpha2
        ratio = (closure.inverse_y2 / closure.inverse_x2).sqrt().sqrt()
        specular = formulas.node(
            "ShaderNodeBsdfAnisotropic",
            Color=inputs.specular_color * (strength * closure.amount * alpha2),
            Roughness=alpha2.sqrt().sqrt().named("roughness"),
            Anisotropy=((1 - ratio) / ratio.at_least(1.0)).named("anisotropy"),
            Normal=closure.normal,
            Tangent=view.tangent,
        )
        specular.distribution = "BECKMANN"
        both = formulas.node("ShaderNodeAddShader")
        links.new(specular.outputs[0], both.inputs[0])
        links.new(total.outputs[0], both.inputs[1])
        total = both
    links.new(total.outputs[0], formulas.node("NodeGroupOutput").inputs[0])


def _strength(
    formulas: NodeFormulas, inputs: _Inputs, view: _View, closures: list[_Closure]
) -> Scalar:
    """4 pi k_s, of a lobe that reflects the same at every view angle as far as energy is conserved.

    What both closures reflect for 4 pi k_s = 1 and F = 1 is the sum of their weights, less what
    masking takes.
    """
    s, alpha = inputs.exponent, inputs.interpolation
    unit = normal_albedo(s, alpha) / (4 * math.pi)
    bent, broad = closures
    weight = bent.amount * bent.alpha2 + broad.amount * broad.alpha2
    reflected = weight * masking(formulas, view.cosine, view.tan2, s, alpha)
    # A product with 0 is what Cycles leaves out, with all that it is made of.
    missing = (1 - unit / reflected).named("missing") * inputs.conserve
    return (inputs.strength / unit).named("4 pi k_s") * (1 - missing)
