"""A picture of a GLB by Blender; for `benchmarks.cad_pictures`.

``python blender_picture.py MODEL.glb PICTURE.png WIDTH HEIGHT AZIMUTH ELEVATION``. Needs ``bpy``, Blender as
a Python module (GPL): never a part of the project.
"""

import math
import sys

import bpy
import mathutils

SAMPLES = 32


def main(model: str, picture: str, width: str, height: str, azimuth: str, elevation: str) -> None:
    """Load the model, look at it from where our renderer does, and draw it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if model.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=model)
    else:
        bpy.ops.wm.usd_import(filepath=model)
    scene = bpy.context.scene
    corners = [
        thing.matrix_world @ mathutils.Vector(corner)
        for thing in scene.objects
        if thing.type == "MESH"
        for corner in thing.bound_box
    ]
    low, high = (mathutils.Vector([f(c[k] for c in corners) for k in range(3)]) for f in (min, max))
    middle, size = (low + high) / 2, (high - low).length
    turned, raised = math.radians(float(azimuth)), math.radians(float(elevation))
    toward = mathutils.Vector(
        (math.cos(raised) * math.sin(turned), -math.cos(raised) * math.cos(turned), math.sin(raised))
    )
    eye = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
    eye.location = middle + 2.1 * size * toward
    eye.rotation_euler = (-toward).to_track_quat("-Z", "Y").to_euler()
    eye.data.lens, eye.data.clip_start, eye.data.clip_end = 70, 0.001 * size, 100 * size
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle = 3.0, 0.2
    sun.rotation_euler = (math.radians(40), 0, turned - math.radians(30))
    for thing in (eye, sun):
        scene.collection.objects.link(thing)
    scene.camera = eye
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.8, 0.85, 0.9, 1)
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
