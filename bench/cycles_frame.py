"""The frames of one of our datasets in Blender's Cycles: the same wall, poses and count of rays.

blender --background --factory-startup --python-exit-code 1 --python bench/cycles_frame.py -- DATASET OUT [--threads N]

Writes OUT/color/000000.png and OUT/depth/000000.exr a frame and OUT/cycles.json with the seconds of each. Every choice that
leaves the picture alone is the fast one: one sample a pixel without its jitter, direct light only, no shadow rays, no noise
removal, the hierarchy kept from frame to frame, files hardly compressed. One unit of Blender's is 1 mm.
"""

import argparse
import json
import os
import re
import sys
import time

import bpy
from mathutils import Matrix, Quaternion, Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import cycles_depth

OPENGL_FROM_OPENCV = Matrix.Diagonal((1.0, -1.0, -1.0, 1.0))


def read_lens(dataset):
    """observations/calibration.yaml as a dictionary; numbers as numbers."""
    lens = {}
    with open(os.path.join(dataset, "observations", "calibration.yaml")) as file:
        for key, value in re.findall(r"^(\w+):\s*([^#\n]+?)\s*(?:#.*)?$", file.read(), re.MULTILINE):
            try:
                lens[key] = float(value)
            except ValueError:
                lens[key] = value
    if lens.get("model") != "brown_conrady" or lens["fx"] != lens["fy"]:
        raise SystemExit("cycles_frame: only Brown-Conrady lenses with fx = fy can be compared")
    return lens


def read_poses(dataset):
    """truth/trajectory.txt as world_from_camera, camera axes as OpenCV has them."""
    poses = []
    with open(os.path.join(dataset, "truth", "trajectory.txt")) as file:
        for line in file:
            if line.strip() and not line.startswith("#"):
                _, x, y, z, qx, qy, qz, qw = map(float, line.split())
                rotation = Quaternion((qw, qx, qy, qz)).to_matrix().to_4x4()
                poses.append(Matrix.Translation((x, y, z)) @ rotation)
    return poses


def add_object(scene, name, data):
    thing = bpy.data.objects.new(name, data)
    scene.collection.objects.link(thing)
    return thing


def mucosa():
    """Diffuse of procedural colour under a GGX coat whose cover varies: two noises, where ours has seven."""
    material = bpy.data.materials.new("mucosa")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()

    def node(kind, **inputs):
        made = nodes.new(kind)
        for name, value in inputs.items():
            made.inputs[name].default_value = value
        return made

    place = node("ShaderNodeNewGeometry").outputs["Position"]
    tone = node("ShaderNodeTexNoise", Scale=1 / 5.3, Detail=2.0)
    colour = nodes.new("ShaderNodeValToRGB")
    colour.color_ramp.elements[0].color = (0.5, 0.13, 0.06, 1.0)
    colour.color_ramp.elements[1].color = (0.74, 0.29, 0.14, 1.0)
    diffuse = node("ShaderNodeBsdfDiffuse")
    film = node("ShaderNodeTexNoise", Scale=1 / 1.3, Detail=0.0)
    coat = node("ShaderNodeBsdfGlossy", Roughness=0.065**0.5)
    coat.distribution = "GGX"
    fresnel = node("ShaderNodeFresnel", IOR=1.336)
    cover = nodes.new("ShaderNodeMath")
    cover.operation = "MULTIPLY"
    mix, output = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeOutputMaterial")
    for source, target in (
        (place, tone.inputs["Vector"]),
        (place, film.inputs["Vector"]),
        (tone.outputs["Fac"], colour.inputs["Fac"]),
        (colour.outputs["Color"], diffuse.inputs["Color"]),
        (film.outputs["Fac"], cover.inputs[0]),
        (fresnel.outputs["Fac"], cover.inputs[1]),
        (cover.outputs[0], mix.inputs["Fac"]),
        (diffuse.outputs["BSDF"], mix.inputs[1]),
        (coat.outputs["BSDF"], mix.inputs[2]),
        (mix.outputs["Shader"], output.inputs["Surface"]),
    ):
        links.new(source, target)
    return material


def add_wall(dataset, scene):
    bpy.ops.import_mesh.ply(filepath=os.path.join(dataset, "truth", "wall.ply"))
    wall = bpy.context.selected_objects[0]
    if wall.name not in scene.collection.objects:
        raise SystemExit("cycles_frame: the wall did not come into the scene")
    wall.matrix_world = Matrix.Identity(4)
    mesh = wall.data
    mesh.flip_normals()  # ours lead out of the lumen; Fresnel's law wants the camera before the wall
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.materials.clear()
    mesh.materials.append(mucosa())
    # Even with 0 bounces Cycles sends a ray on from the wall, in case it finds a light. Nothing is there to be found: a wall
    # that such rays do not see gives the same picture in three quarters of the time.
    wall.visible_diffuse = wall.visible_glossy = wall.visible_transmission = wall.visible_shadow = False
    return len(mesh.polygons)


def add_camera(scene, lens, poses):
    """A pinhole with the lens's fx, fy, cx, cy, and a light in it.

    Cycles has no Brown-Conrady, so distortion is left out: its rays are the undistorted ones, as many as ours.
    """
    width, height = lens["width"], lens["height"]
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "HORIZONTAL"
    data.sensor_width = width  # "mm" of which there is one a pixel
    data.lens = lens["fx"]
    data.shift_x = (width / 2 - lens["cx"]) / width
    data.shift_y = (lens["cy"] - height / 2) / width
    data.clip_start, data.clip_end = 0.1, 1000.0
    camera = add_object(scene, "camera", data)
    camera.rotation_mode = "QUATERNION"
    for frame, pose in enumerate(poses):
        place, rotation, _ = (pose @ OPENGL_FROM_OPENCV).decompose()
        camera.location, camera.rotation_quaternion = place, rotation
        camera.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("rotation_quaternion", frame=frame)
    scene.camera = camera

    light = bpy.data.lights.new("light", "POINT")
    light.energy = 5e4
    light.shadow_soft_size = 0.001
    light.cycles.cast_shadow = False  # in the camera it lights what is seen: ours traces no shadow rays either
    lamp = add_object(scene, "light", light)
    lamp.parent = camera
    lamp.visible_camera = False


def set_cycles(scene, lens, frames, threads):
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = int(lens["width"]), int(lens["height"])
    scene.render.resolution_percentage = 100
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    scene.render.use_persistent_data = True
    scene.frame_start, scene.frame_end = 0, frames - 1
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = 1
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.use_auto_tile = False
    cycles.max_bounces = 0
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01  # rays through the pixels' centres
    scene.view_settings.view_transform = "Standard"
    scene.render.dither_intensity = 0.0
    scene.view_layers[0].use_pass_combined = scene.view_layers[0].use_pass_z = True


def set_output(scene, out):
    """The picture is the frame's own file; depth (along z, as ours) comes from a node."""
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth, image.compression = "PNG", "RGB", "8", 0
    scene.render.filepath = os.path.join(out, "color", "######.png")
    scene.use_nodes = True
    nodes = scene.node_tree.nodes
    nodes.clear()
    layers, combined = nodes.new("CompositorNodeRLayers"), nodes.new("CompositorNodeComposite")
    depth = nodes.new("CompositorNodeOutputFile")
    depth.base_path = os.path.join(out, "depth")
    depth.file_slots[0].path = "######"
    depth.format.file_format, depth.format.color_mode = "OPEN_EXR", "RGB"
    depth.format.color_depth, depth.format.exr_codec = "32", "NONE"
    scene.node_tree.links.new(layers.outputs["Image"], combined.inputs["Image"])
    scene.node_tree.links.new(layers.outputs["Depth"], depth.inputs[0])


class Laps:
    """Seconds from one call to the next: by the clock, and of all cores."""

    def __init__(self):
        self.ends = [(time.perf_counter(), time.process_time())]

    def lap(self, *_):
        self.ends.append((time.perf_counter(), time.process_time()))

    def seconds(self):
        pairs = list(zip(self.ends, self.ends[1:]))
        return {
            "frame_s": [after[0] - before[0] for before, after in pairs],
            "core_s": [after[1] - before[1] for before, after in pairs],
        }


def render_to_files():
    """From one frame written to the next; the first holds the building of the hierarchy."""
    laps = Laps()
    bpy.app.handlers.render_write.append(laps.lap)
    bpy.ops.render.render(animation=True)
    bpy.app.handlers.render_write.remove(laps.lap)
    return laps.seconds()


def render_without_files(scene):
    """The same frames, kept in memory and thrown away: what Cycles takes when nobody reads the result."""
    scene.use_nodes = False
    laps = Laps()
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        bpy.ops.render.render()
        laps.lap()
    return laps.seconds()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("dataset")
    parser.add_argument("out")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    arguments = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])

    lens, poses = read_lens(arguments.dataset), read_poses(arguments.dataset)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    triangles = add_wall(arguments.dataset, scene)
    add_camera(scene, lens, poses)
    set_cycles(scene, lens, len(poses), arguments.threads)
    set_output(scene, arguments.out)
    result = {
        "blender": bpy.app.version_string,
        "triangles": triangles,
        "threads": arguments.threads,
        "with_files": render_to_files(),
        "without_files": render_without_files(scene),
    }
    frames = [f"{i:06d}" for i in range(len(poses))]
    result["depth_difference_mm"] = cycles_depth.differences_mm(arguments.dataset, arguments.out, frames, lens)
    with open(os.path.join(arguments.out, "cycles.json"), "w") as file:
        json.dump(result, file, indent=2)


main()
