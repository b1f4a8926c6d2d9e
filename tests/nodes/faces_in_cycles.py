# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside Blender 3.4: what Cycles shows of a material at many values of an attribute, one face of one pixel for each."""

import tempfile

import bpy
import numpy


class Faces:
    """A new scene of a mesh of unit squares, `width` in a row, each with its value of the attribute `name`.

    values: float32[N] or float32[N][3].
    """

    def __init__(self, name, values, width, material):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene, values = bpy.context.scene, numpy.asarray(values, numpy.float32)
        self._count, self._width, self._height = len(values), width, -(-len(values) // width)
        places = [(n % width, n // width) for n in range(self._count)]
        corners = [(x + dx, y + dy, 0) for x, y in places for dx, dy in ((0, 0), (1, 0), (1, 1), (0, 1))]
        mesh = bpy.data.meshes.new("Faces")
        mesh.from_pydata(corners, [], [range(4 * n, 4 * n + 4) for n in range(self._count)])
        kind, field = ("FLOAT", "value") if values.ndim == 1 else ("FLOAT_VECTOR", "vector")
        mesh.attributes.new(name, kind, "FACE").data.foreach_set(field, values.ravel())
        mesh.materials.append(material())
        camera = bpy.data.cameras.new("Camera")
        camera.type, camera.ortho_scale = "ORTHO", max(width, self._height)
        scene.camera = bpy.data.objects.new("Camera", camera)
        scene.camera.location = (width / 2, self._height / 2, 5)
        for thing in (bpy.data.objects.new("Faces", mesh), scene.camera):
            scene.collection.objects.link(thing)
        render, cycles = scene.render, scene.cycles
        render.engine = "CYCLES"
        render.resolution_x, render.resolution_y = width, self._height
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = 1, False, False
        cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01

    def render(self):
        """float32[N][3]: linear Rec. 709."""
        with tempfile.TemporaryDirectory() as folder:
            path = bpy.context.scene.render.filepath = f"{folder}/faces.exr"
            bpy.ops.render.render(write_still=True)
            image = bpy.data.images.load(path)
            image.colorspace_settings.name = "Linear"
            pixels = numpy.empty(self._width * self._height * 4, numpy.float32)
            image.pixels.foreach_get(pixels)
            bpy.data.images.remove(image)
        return pixels.reshape(-1, 4)[: self._count, :3]
