"""What a baked material is to do whatever stands around it: shine as its formula in a white world,
and stay finite and lit on any surface under any light.
"""

import bpy
import numpy as np
from facets import SIZE, UP, add, add_camera, facet_mesh, new_scene, pixels_of, render_facets
from lobefit import _native
from mathutils import Matrix


def group_node(material):
    return next(node for node in material.node_tree.nodes if node.type == "GROUP")


def described(group):
    """All of a group that its source tells, as values; the group is removed."""
    nodes = [(n.name, n.bl_idname, n.label, tuple(n.location)) for n in group.nodes]
    ends = [(k.from_node.name, k.to_node.name, k.to_socket.identifier) for k in group.links]
    bpy.data.node_groups.remove(group)
    return nodes, ends


def connect_normal(material, socket):
    material.node_tree.links.new(socket, group_node(material).inputs["Normal"])


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def quadrature(cosine, rings=400, sectors=180):
    """Lights (N, 3) by half vectors that crowd at the normal, their solid angles, and the view."""
    viewer = np.array([(1 - cosine**2) ** 0.5, 0.0, cosine])
    t, phi = np.meshgrid(
        (np.arange(rings) + 0.5) / rings, (np.arange(sectors) + 0.5) / sectors * 2 * np.pi
    )
    t, phi = t.ravel(), phi.ravel()
    theta = t**2 * np.pi / 2
    half = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    incidence = half @ viewer
    lights = 2 * incidence[:, None] * half - viewer
    solid_angle = 4 * incidence * np.sin(theta) * (t * np.pi / rings) * (2 * np.pi / sectors)
    on = (incidence > 0) & (lights[:, 2] > 0)
    return lights[on], solid_angle[on], np.tile(viewer, (on.sum(), 1))


def albedo(closures, cosine):
    lights, solid_angle, viewers = quadrature(cosine)
    return solid_angle @ _native.evaluate_closures(closures, lights, viewers)


def white_world_albedo(folder, material, white, angle):
    """What a plane of the material shows under the world `white`, seen at an angle (degrees): RGB.

    Its noise is below 1e-4 of it.
    """
    scene = new_scene(SIZE, samples=64)
    scene.cycles.max_bounces = 1
    scene.world = white
    mesh = bpy.data.meshes.new("plane")
    corners = [(-99, -99, 0), (99, -99, 0), (99, 99, 0), (-99, 99, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    add(scene, mesh)
    place = Matrix.Rotation(np.radians(angle), 4, "Y") @ Matrix.Translation((0, 0, 9))
    add_camera(scene, place, width=1.0)
    return pixels_of(scene, folder).mean(0)


def bend_as_crowds_do(material):
    """Connects the normals that a `Crowd` brings along; they are not of unit length."""
    attribute = material.node_tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "bent"
    connect_normal(material, attribute.outputs["Vector"])
    return material


class Crowd:
    """Facets with any normal, any smooth normal, any connected normal and any of some materials.

    The materials come from `bend_as_crowds_do`, and should hold a bright diffuse closure, which
    alone would light a pixel: NaN of another closure makes it black.
    """

    def __init__(self, materials, size, seed):
        rng = np.random.default_rng(seed)

        def near(normals, spread):
            return unit(normals + spread * rng.normal(0, 1, normals.shape))

        count = size**2
        self.flat = near(np.tile(UP, (count, 1)), 3.0)
        self.flat[:, 2] = np.maximum(np.abs(self.flat[:, 2]), 0.02)
        self.flat = unit(self.flat)
        self.smooth, self.bent = near(self.flat, 0.5), near(self.flat, 0.5)
        # Some are not bent, and some face the viewer exactly.
        self.bent[::5] = self.smooth[::5]
        self.flat[::7] = self.smooth[::7] = self.bent[::7] = UP
        self.mesh = facet_mesh(self.flat)
        self.mesh.shade_smooth()
        self.mesh.normals_split_custom_set(np.repeat(self.smooth, 4, axis=0).tolist())
        lengths = rng.uniform(0.1, 3, (count, 1))
        bent = self.mesh.attributes.new("bent", "FLOAT_VECTOR", "FACE")
        bent.data.foreach_set("vector", (self.bent * lengths).ravel().astype(np.float32))
        for material in materials:
            self.mesh.materials.append(material)
        which = rng.integers(0, len(materials), count).astype(np.int32)
        self.mesh.polygons.foreach_set("material_index", which)

    def faults(self, folder, light):
        """How many pixels are not finite or negative, and how many are black without a reason."""
        rendered = render_facets(folder, self.mesh, light)
        # Cycles shows no diffuse closure whose normal is turned away from the smooth one.
        lit = (self.smooth * self.bent).sum(1) > 0.1
        for normals in (self.flat, self.smooth, self.bent):
            lit &= (normals @ light > 0.1) & (normals[:, 2] > 0.01)
        wrong = ~np.isfinite(rendered).all(1) | (rendered < 0).any(1)
        return wrong.sum(), (lit & (rendered <= 0).any(1)).sum(), lit.sum()
