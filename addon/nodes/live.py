"""The node group 'Lobefit Live': the interpolated lobe in closed form, every parameter a socket.

One Beckmann closure with a bent normal plus a diffuse closure. The formulas are derived in
native/closures/live_lobe.h, and native/closures/live_lobe.cpp computes the same in C++ with the
same names, so that previews need no rendering.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import bpy

from .tree import NodeFormulas, Scalar, Vector

NAME = "Lobefit Live"
# Saved with the group: a file's group is used again only if it is the same group. To be raised
# with any change of the formulas.
VERSION = 1
VERSION_KEY = "lobefit_version"

# Sharper lobes are drawn as this one, with the same albedo: single precision loses their peak.
EXPONENT_LIMIT = 1e5
# Added to the tangent: at normal incidence nothing else is left of it, and Cycles makes NaN of a
# tangent along the normal. Its direction is one that no modelled surface faces.
TINY_TANGENT = (3.7e-7, 5.9e-7, 7.1e-7)
# The same factors, fitted to the formula of the lobe, as `Correction` in live_lobe.cpp.
LEAST_CURVATURE = 0.87
TILT_Z, TILT_ZZ = 0.59, -1.71
OFFSET_ALPHA = -0.77
X_ZZ, X_Q = -1.16, 1.0
Y_Z, Y_Q = 0.04, 12.5
WEIGHT_ZZ, WEIGHT_ALPHA, WEIGHT_Q = -0.31, -0.14, 0.61


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
    for group in bpy.data.node_groups:
        if group.library is None and group.get(VERSION_KEY) == VERSION:
            return group
    group = bpy.data.node_groups.new(NAME, "ShaderNodeTree")
    group[VERSION_KEY] = VERSION
    _add_sockets(group)
    _add_nodes(NodeFormulas(group))
    return group


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


@dataclass
class _Inputs:
    base_color: Vector
    specular_color: Vector
    strength: Scalar
    exponent: Scalar
    interpolation: Scalar
    ior: Scalar
    fresnel: Scalar
    normal: Vector


@dataclass
class _View:
    tangent: Vector
    cosine: Scalar
    sine: Scalar


@dataclass
class _Lobe:
    """The lobe at the peak of its Phong relative, for k_s = 1: see live_lobe.h, step 1."""

    y: Scalar
    p: Scalar
    m: Scalar
    log_base: Scalar
    tan2_i: Scalar
    slope: Scalar
    curvature: Scalar
    z: Scalar


@dataclass
class _Fresnel:
    value: Scalar
    slope: Scalar
    curvature: Scalar


@dataclass
class _Closure:
    tilt: Scalar
    inverse_x2: Scalar
    inverse_y2: Scalar
    weight: Scalar


def _add_nodes(formulas: NodeFormulas) -> None:
    with formulas.frame("Inputs"):
        inputs = _inputs(formulas)
    with formulas.frame("View"):
        view = _view(formulas, inputs)
    with formulas.frame("Lobe at its peak"):
        lobe = _lobe(inputs, view)
    with formulas.frame("Fresnel"):
        tan_peak = (view.sine - view.cosine * lobe.y) / (view.cosine + view.sine * lobe.y)
        fresnel = _fresnel(inputs, tan_peak.named("tan theta'"))
    with formulas.frame("Matching Beckmann lobe"):
        closure = _closure(inputs, view, lobe, fresnel, tan_peak)
    with formulas.frame("Closures"):
        _shaders(formulas, inputs, view, closure)
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
    )


def _view(formulas: NodeFormulas, inputs: _Inputs) -> _View:
    incoming = Vector(formulas, formulas.node("ShaderNodeNewGeometry").outputs["Incoming"])
    cosine = incoming.dot(inputs.normal)
    across = incoming - inputs.normal * cosine
    return _View(
        tangent=(across + TINY_TANGENT).normalised().named("tangent"),
        cosine=cosine.at_least(1e-3).named("cos theta"),
        sine=across.length().named("sin theta"),
    )


def _lobe(inputs: _Inputs, view: _View) -> _Lobe:
    s, alpha = inputs.exponent, inputs.interpolation
    tan_o = (view.sine / view.cosine).named("tan theta")
    s1 = s + 1
    root = (s1 * s1 + 4 * s * (tan_o * tan_o)).sqrt()
    x = (2 * tan_o / (s1 + root)).named("tan 2 tau")
    y = (x / ((x * x + 1).sqrt() + 1)).named("tan tau")
    p = (1 / (y * y + 1)).named("cos2 tau")
    e = (y * y * p).named("sin2 tau")
    alpha_e = alpha * e
    missing = e * (2 - alpha_e)
    base = (1 - missing).named("base")
    r = missing / (base + 1)
    r2 = r * r
    log_base = (-2 * r * (r2 * (r2 * 0.2 + 1 / 3) + 1)).named("ln base")
    base_slope = y * p * (alpha_e * -2 + 2) / base
    bends = (1 - alpha) * (e * -2 + 1) + alpha * p * (e * -4 + 1)
    tan_i = s * x
    tan2_i = tan_i * tan_i
    curvature = s * (bends / base + base_slope * base_slope) + 1 + tan2_i
    return _Lobe(
        y=y,
        p=p,
        m=(alpha * p * p / base).named("m"),
        log_base=log_base,
        tan2_i=tan2_i,
        slope=(s * (base_slope - x)).named("slope"),
        curvature=curvature.named("H"),
        z=(tan2_i / curvature).named("z"),
    )


def _fresnel(inputs: _Inputs, tangent: Scalar) -> _Fresnel:
    """R_F at the peak and the derivatives of its logarithm: see live_lobe.h, step 4."""
    excess = (inputs.ior - 1) * (inputs.ior + 1)
    tan2 = tangent * tangent
    v = excess * (tan2 + 1)
    d = v / ((v + 1).sqrt() + 1)
    h = v / (v + 1)
    rs = (d / (d + 2)).named("r_s")
    rp = ((d - excess) / (d + 2 + excess)).named("r_p")
    s2, p2 = rs * rs, rp * rp
    reflectance = ((s2 + p2) * 0.5).named("R_F")
    value = ((reflectance - 1) * inputs.fresnel + 1).named("F")
    share = inputs.fresnel / value
    free_s, free_p = 1 - s2, 1 - p2
    first = share * ((rs * free_s + rp * free_p) * 0.5)
    second = share * (((s2 * -3 + 1) * free_s + (p2 * -3 + 1) * free_p) * 0.25)
    bend = h * (tan2 * (h * -2 + 3) + 1)
    slope = first * h
    return _Fresnel(
        value=value,
        slope=slope.named("(ln F)' / tan"),
        curvature=(first * bend + tan2 * (second * (h * h) - slope * slope)).named("(ln F)''"),
    )


def _closure(
    inputs: _Inputs, view: _View, lobe: _Lobe, fresnel: _Fresnel, tan_peak: Scalar
) -> _Closure:
    s, alpha, y, p, z = inputs.exponent, inputs.interpolation, lobe.y, lobe.p, lobe.z
    curvature = fresnel.curvature * -0.25 + lobe.curvature
    curvature = curvature.at_least(lobe.curvature * LEAST_CURVATURE).named("curvature")
    slope = fresnel.slope * tan_peak * 0.5 + lobe.slope
    step = slope / curvature
    # The mirror direction of the bent normal stays above the horizon.
    lowest = -0.9 * view.cosine / (view.sine + 1)
    tilt = (step * -0.5 + y) * (z * (z * TILT_ZZ + TILT_Z) + 1)
    tilt = tilt.at_least(lowest).named("tan tilt")
    moved = 2 * p * (y - tilt)

    shrink = (tilt * tilt + 1).inverse_sqrt()
    c = ((view.cosine + view.sine * tilt) * shrink).named("c")
    d = ((view.sine - view.cosine * tilt) * shrink).named("d")
    c2, cd = c * c, c * d
    across = s * (c2 + lobe.m * (tilt * cd * -2 + d * d)) + c2
    j = fresnel.slope * (c2 * -0.5 + 0.25) + across
    j = j.at_least(across * LEAST_CURVATURE).named("j")
    ratio = cd / j
    q = (ratio * ratio * curvature * (1 / 16)).named("q")
    offset = alpha * OFFSET_ALPHA + 2
    zz = z * z
    inverse_x2 = 2 * curvature * (zz * X_ZZ + 1) / (q * X_Q + 1) + offset
    inverse_y2 = 2 * j * (z * lobe.m * Y_Z + 1) / (q * Y_Q + 1) + offset

    log_peak = s * lobe.log_base + moved * (curvature * moved * -0.5 + slope)
    correction = (zz * WEIGHT_ZZ + alpha / (s + 1) * WEIGHT_ALPHA + 1) / (q * WEIGHT_Q + 1)
    masking = 2 * _beckmann_lambda(d * d / (c2 * inverse_x2)) + 1
    peak = log_peak.exp() * fresnel.value * correction * masking
    size = (inverse_x2 * inverse_y2 * (lobe.tan2_i + 1)).inverse_sqrt()
    return _Closure(
        tilt=tilt,
        inverse_x2=inverse_x2.named("1 / alpha_x^2"),
        inverse_y2=inverse_y2.named("1 / alpha_y^2"),
        weight=(4 * math.pi * c * peak * size).named("weight for k_s = 1"),
    )


def _beckmann_lambda(q: Scalar) -> Scalar:
    """Lambda of Cycles' Beckmann masking for q = (alpha tan theta)^2."""
    c = q.inverse_sqrt()
    masked = (c * (c * 0.396 - 1.259) + 1) / (c * (c * 2.181 + 3.535))
    return (masked * q.is_over(0.39)).named("Lambda")


def _shaders(formulas: NodeFormulas, inputs: _Inputs, view: _View, closure: _Closure) -> None:
    # Cycles takes sqrt(alpha) as roughness, and the ratio of the two alphas as anisotropy.
    roughness = (closure.inverse_x2 * closure.inverse_y2).inverse_sqrt().sqrt().sqrt()
    ratio = (closure.inverse_y2 / closure.inverse_x2).sqrt().sqrt()
    anisotropy = (1 - ratio) / ratio.at_least(1.0)
    k_s = inputs.strength / normal_albedo(inputs.exponent, inputs.interpolation)
    specular = formulas.node(
        "ShaderNodeBsdfAnisotropic",
        Color=inputs.specular_color * (k_s.named("k_s") * closure.weight),
        Roughness=roughness.named("roughness"),
        Anisotropy=anisotropy.named("anisotropy"),
        Normal=(inputs.normal + view.tangent * closure.tilt).named("bent normal"),
        Tangent=view.tangent,
    )
    specular.distribution = "BECKMANN"
    diffuse = formulas.node("ShaderNodeBsdfDiffuse", Color=inputs.base_color, Normal=inputs.normal)
    both = formulas.node("ShaderNodeAddShader")
    output = formulas.node("NodeGroupOutput")
    links = formulas.tree.links
    links.new(specular.outputs[0], both.inputs[0])
    links.new(diffuse.outputs[0], both.inputs[1])
    links.new(both.outputs[0], output.inputs[0])
