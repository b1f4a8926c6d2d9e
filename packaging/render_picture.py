# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by packaging/quickstart inside Blender: renders the open scene with Lambent to OUT.exr and OUT.png by an INTEGRATOR of its.

    blender -b scene.blend --python-exit-code 1 --python render_picture.py -- OUT SAMPLES INTEGRATOR
"""

import sys
import time

import bpy


def save(scene, path, media_type="IMAGE", **settings):
    image_settings = scene.render.image_settings
    if hasattr(image_settings, "media_type"):  # from Blender 5.0 on, and before the format
        image_settings.media_type = media_type
    for name, value in settings.items():
        setattr(image_settings, name, value)
    bpy.data.images["Render Result"].save_render(path, scene=scene)


def main():
    out, samples, integrator = sys.argv[sys.argv.index("--") + 1 :]
    scene = bpy.context.scene
    if not hasattr(scene, "lambent"):
        raise RuntimeError("the Lambent add-on is not enabled: run packaging/install_addon")
    scene.render.engine = "LAMBENT"
    scene.lambent.samples = int(samples)
    scene.lambent.integrator = integrator
    start = time.monotonic()
    bpy.ops.render.render()  # raises when the engine reports an error
    seconds = time.monotonic() - start
    save(scene, out + ".exr", file_format="OPEN_EXR", color_depth="32", exr_codec="ZIP", color_mode="RGB")
    save(scene, out + ".png", file_format="PNG", color_depth="8", color_mode="RGB")
    size = scene.render.resolution_x, scene.render.resolution_y
    print(f"render_picture: {size[0]}x{size[1]} pixels, {samples} samples each by {integrator}, in {seconds:.1f} s")


main()
