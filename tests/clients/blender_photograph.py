"""Render the scene of `render_real` by Cycles: python blender_photograph.py SCENE.json (with bpy).

Writes an array (l, h, w, 3) of luminance for each part of the light, lamp by lamp. Mirrors are
points of a cloud, which Cycles renders as spheres. Lengths are mm as Blender's units.
"""

import json
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

TOLD = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
OUT = Path(TOLD["out"])


def material(name, kind, **inputs):
    """A material of one node."""
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    shader, end = nodes.new(kind), nodes.new("ShaderNodeOutputMaterial")
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    links.new(shader.outputs[0], end.inputs["Surface"])
    return made


def add_mirrors():
    """Spheres without loss."""
    mesh = bpy.data.meshes.new("mirrors")
    mesh.from_pydata(TOLD["centre"], [], [])
    body = bpy.data.objects.new("mirrors", mesh)
    bpy.context.collection.objects.link(body)
    bpy.context.view_layer.objects.active = body
    body.select_set(True)
    bpy.ops.object.convert(target="POINTCLOUD")
    cloud = bpy.context.view_layer.objects.active.data
    if "radius" not in cloud.attributes:
        cloud.attributes.new("radius", "FLOAT", "POINT")
    cloud.attributes["radius"].data.foreach_set("value", np.array(TOLD["radius"], np.float32))
    white = (1.0, 1.0, 1.0, 1.0)
    cloud.materials.append(material("mirror", "ShaderNodeBsdfGlossy", Color=white, Roughness=0.0))


def add_object(path):
    """An object of a file, and its two materials."""
    lines = Path(path).read_text(encoding="utf-8").splitlines()
    start = lines.index("end_header") + 1
    count = int(lines[2].split()[-1])
    rows = np.array([line.split() for line in lines[start : start + count]], float)
    faces = [[int(k) for k in line.split()[1:]] for line in lines[start + count :]]
    mesh = bpy.data.meshes.new("object")
    mesh.from_pydata(rows[:, :3].tolist(), [], faces)
    colours = mesh.color_attributes.new("colour", "FLOAT_COLOR", "POINT")
    opaque = np.column_stack([rows[:, 6:], np.ones(len(rows))]).astype(np.float32)
    colours.data.foreach_set("color", opaque.ravel())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), dtype=bool))
    mesh.normals_split_custom_set_from_vertices(rows[:, 3:6].tolist())
    matt = material("matt", "ShaderNodeBsdfDiffuse", Roughness=0.0)
    colour = matt.node_tree.nodes.new("ShaderNodeVertexColor")
    colour.layer_name = "colour"
    shader = next(one for one in matt.node_tree.nodes if one.type == "BSDF_DIFFUSE")
    matt.node_tree.links.new(colour.outputs["Color"], shader.inputs["Color"])
    black = (0.0, 0.0, 0.0, 1.0)
    gloss = material(
        "gloss",
        "ShaderNodeBsdfPrincipled",
        Base_Color=black,
        Roughness=TOLD["roughness"],
        IOR=TOLD["index"],
    )
    body = bpy.data.objects.new("object", mesh)
    bpy.context.collection.objects.link(body)
    return body, {"matt": matt, "gloss": gloss}


def add_lamps():
    """Area lights; a Lambertian face of radiance L and area A gives pi L A watts."""
    found = []
    for number, (place, way) in enumerate(zip(*TOLD["lamps"], strict=True)):
        light = bpy.data.lights.new(f"lamp_{number}", "AREA")
        light.shape = "RECTANGLE"
        light.size, light.size_y = TOLD["lamp_mm"]
        light.energy = np.pi * TOLD["radiance"] * light.size * light.size_y
        body = bpy.data.objects.new(light.name, light)
        ahead = Vector(way)  # it shines along -z; y is up
        right = ahead.cross(Vector((0, 0, 1)))
        turn = Matrix([right, (0, 0, 1), -ahead]).transposed().to_4x4()
        body.matrix_world = Matrix.Translation(place) @ turn
        bpy.context.collection.objects.link(body)
        found.append(body)
    return found


def add_camera(scene):
    """A thin lens, and the part of its picture that is rendered."""
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "HORIZONTAL", TOLD["angle"]
    camera.clip_start, camera.clip_end = 1.0, 1e4
    camera.dof.use_dof, camera.dof.focus_distance = True, TOLD["focus_mm"]
    # Of a focal length in thousandths of Blender's unit.
    camera.dof.aperture_fstop = camera.lens * 1e-3 / TOLD["aperture_mm"]
    body = bpy.data.objects.new("camera", camera)
    body.matrix_world = Matrix(TOLD["matrix"])
    scene.collection.objects.link(body)
    scene.camera = body
    width, height = TOLD["size"]
    left, top, columns, rows = TOLD["crop"]
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = left / width, (left + columns) / width
    render.border_min_y, render.border_max_y = 1 - (top + rows) / height, 1 - top / height


def set_rays(scene):
    """Light meets one mirror, then the object, then a lamp."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples = TOLD["samples"]
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces, cycles.glossy_bounces, cycles.diffuse_bounces = 1, 1, 0
    cycles.caustics_reflective = True
    cycles.blur_glossy = cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.pixel_filter_type = "BOX"
    scene.world = bpy.data.worlds.new("dark")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    scene.view_settings.view_transform = "Raw"
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"


def photograph(scene, name):
    """Luminance (h, w, 3)."""
    scene.render.filepath = str(OUT / f"{name}.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, -1)[::-1, :, :3]


bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
add_mirrors()
lamps = add_lamps()
add_camera(scene)
set_rays(scene)
for part, (path, kind, shining) in TOLD["parts"].items():
    body, materials = add_object(path)
    body.data.materials.append(materials[kind])
    found = []
    for number in shining:
        for other in lamps:
            other.hide_render = other is not lamps[number]
        scene.cycles.seed = number
        found.append(photograph(scene, f"{part}_{number}"))
    np.save(OUT / f"{part}.npy", np.array(found))
    bpy.data.objects.remove(body)
