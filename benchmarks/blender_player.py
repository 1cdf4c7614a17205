"""A rigged GLB in Blender: pictures, and where its corners are; for `benchmarks.players`.

``python blender_player.py REQUEST.json``: reads models, poses and cameras, writes what `benchmarks.players`
asks for. Needs ``bpy``, Blender as a Python module (GPL): never a part of the project.
"""

import json
import math
import sys
from pathlib import Path
from typing import Any

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

SAMPLES = 48


def main() -> None:
    """Load each model, take its poses, write corners and pictures."""
    request = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    corners = {}
    for name, file in request["models"].items():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.render.fps = request["fps"]
        # Bones at rest are then as the nodes are without an animation.
        bpy.ops.import_scene.gltf(filepath=file, merge_vertices=False, guess_original_bind_pose=False)
        for number, (clip, frame) in enumerate(request["poses"]):
            pose(clip, frame)
            corners[f"{name}_{number}"] = posed_corners()
            if name == request["drawn"]:
                draw(request, Path(request["pictures"][number]))
    np.savez(request["corners"], allow_pickle=False, **corners)


def pose(clip: str | None, frame: int) -> None:
    """Play one animation alone, up to a frame; None: what the joints have without one."""
    for thing in bpy.data.objects:
        data = thing.animation_data
        if data is None:
            continue
        data.action = None
        for track in data.nla_tracks:
            track.mute = True
            if track.name == clip:
                # The action itself: as a strip it would begin a frame later.
                data.action = track.strips[0].action
                data.action_slot = track.strips[0].action_slot
        if clip is None and thing.type == "ARMATURE":
            for bone in thing.pose.bones:
                bone.matrix_basis.identity()
    bpy.context.scene.frame_set(frame)


def posed_corners() -> NDArray[np.float64]:
    """Return (T, 3, 3) where the triangles' corners are in space, z up."""
    graph = bpy.context.evaluated_depsgraph_get()
    parts = []
    for thing in sorted(bpy.data.objects, key=lambda thing: thing.name):
        if thing.type != "MESH" or thing.find_armature() is None:
            continue
        posed = thing.evaluated_get(graph)
        mesh = posed.to_mesh()
        mesh.calc_loop_triangles()
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        index = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", index)
        world = np.array(posed.matrix_world)
        places = points.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
        parts.append(places[index].reshape(-1, 3, 3))
        posed.to_mesh_clear()
    return np.concatenate(parts)


def draw(request: dict[str, Any], file: Path) -> None:
    """Take a picture by Cycles."""
    scene = bpy.context.scene
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle_y = "VERTICAL", math.radians(request["camera"]["angle"])
    camera.clip_start, camera.clip_end = request["camera"]["near"], request["camera"]["far"]
    right, up, forward = (mathutils.Vector(axis) for axis in request["camera"]["axes"])
    eye = bpy.data.objects.new("camera", camera)
    eye.matrix_world = (
        mathutils.Matrix.Translation(request["camera"]["eye"])
        @ mathutils.Matrix((right, up, -forward)).transposed().to_4x4()
    )
    lamp = bpy.data.lights.new("sun", "SUN")
    lamp.energy, lamp.angle = 2.2, math.radians(12)
    sun = bpy.data.objects.new("sun", lamp)
    # From above, the left, and the camera's side.
    toward = (2 * up - right - forward).normalized()
    sun.matrix_world = toward.to_track_quat("Z", "Y").to_matrix().to_4x4()
    for thing in (eye, sun):
        scene.collection.objects.link(thing)
    scene.camera = eye
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.8, 0.83, 0.87, 1)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1.0
    scene.world = world
    scene.view_settings.view_transform = "Standard"
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", SAMPLES
    scene.render.resolution_x, scene.render.resolution_y = request["size"]
    scene.render.filepath = str(file)
    bpy.ops.render.render(write_still=True)
    for thing in (eye, sun):
        bpy.data.objects.remove(thing)


main()
