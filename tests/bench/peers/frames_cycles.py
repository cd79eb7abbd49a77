"""Frames by Blender's Cycles, as frames_vtk.py makes them:

    blender -b --factory-startup -noaudio -P frames_cycles.py -- SCENE WIDTH HEIGHT FOV

A job has "samples" and "shadows" besides, and "size" and "radiance" in its light, a square. No
bounces, no denoising: direct light alone, like everybody else's."""
import builtins
import json
import math
import os
import sys
import time

import numpy
for name in ("bool", "int", "float", "object"):  # Debian 12: Blender 3.4's glTF reader is older
    setattr(numpy, name, getattr(builtins, name))
import bpy
from mathutils import Vector

scene_file, width, height, fov = sys.argv[sys.argv.index("--") + 1:]
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)  # Blender says what it does on stdout

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=scene_file)
scene = bpy.context.scene
world = bpy.data.worlds.new("dark")
world.use_nodes = True
world.node_tree.nodes["Background"].inputs[1].default_value = 0
scene.world = world


def blender(point):
    """Blender's z is up."""
    x, y, z = point
    return Vector((x, -z, y))


def aim(thing, position, target):
    thing.location = blender(position)
    direction = blender(target) - blender(position)
    thing.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()


camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.data.sensor_fit = "VERTICAL"
camera.data.angle_y = math.radians(float(fov))
camera.data.clip_start = 0.1
light = bpy.data.objects.new("light", bpy.data.lights.new("light", "AREA"))
light.data.shape = "SQUARE"
for thing in (camera, light):
    scene.collection.objects.link(thing)
scene.camera = camera
for material in bpy.data.materials:
    shader = material.node_tree and material.node_tree.nodes.get("Principled BSDF")
    if shader:
        shader.inputs["Specular"].default_value = 0
render = scene.render
render.engine = "CYCLES"
render.resolution_x, render.resolution_y, render.resolution_percentage = int(width), int(height), 100
render.image_settings.file_format = "PNG"
render.image_settings.color_mode = "RGB"
render.image_settings.compression = 15
render.use_persistent_data = True
scene.view_settings.view_transform = "Standard"
cycles = scene.cycles
cycles.device = "CPU"
cycles.max_bounces = 0
cycles.use_denoising = False
cycles.use_adaptive_sampling = False
cycles.pixel_filter_type = "BOX"
cycles.filter_width = 1.0

for line in sys.stdin:
    job = json.loads(line)
    begun = time.perf_counter()
    aim(camera, job["eye"], job["target"])
    aim(light, job["light"]["position"], job["light"]["target"])
    light.data.size = job["light"]["size"]
    light.data.energy = math.pi * job["light"]["radiance"] * job["light"]["size"] ** 2
    for thing in scene.objects:
        if thing.visible_shadow != job["shadows"]:
            thing.visible_shadow = job["shadows"]
    cycles.samples = job["samples"]
    render.filepath = job["file"]
    bpy.ops.render.render(write_still=True)
    answers.write(json.dumps({"ms": 1e3 * (time.perf_counter() - begun),
                              "about": "Blender " + bpy.app.version_string}) + "\n")
    answers.flush()
