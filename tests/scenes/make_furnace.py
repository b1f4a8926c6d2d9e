# SPDX-License-Identifier: GPL-3.0-or-later
"""The furnace: spheres of white lobes in an evenly white world. No pixel may be brighter than the background, and those of
lossless lobes (smooth ones, Lambertian, translucent, transparent) must vanish into it. One column a lobe, one row a
roughness."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blocks

k_lobes = (
    ("Diffuse", "ShaderNodeBsdfDiffuse", {"Roughness": (0.0, 0.5, 1.0)}),
    ("Translucent", "ShaderNodeBsdfTranslucent", {}),
    ("Transparent", "ShaderNodeBsdfTransparent", {}),
    ("Glossy", "ShaderNodeBsdfGlossy", {"Roughness": (0.0, 0.2, 0.6)}),
    ("Glass", "ShaderNodeBsdfGlass", {"Roughness": (0.0, 0.2, 0.6)}),
    ("Principled", "ShaderNodeBsdfPrincipled", {"Roughness": (0.1, 0.5, 1.0)}),
)


def main():
    scene = blocks.begin()
    for column, (name, node_type, rows) in enumerate(k_lobes):
        for row in range(3):
            inputs = {key: values[row] for key, values in rows.items()}
            color = "Base_Color" if node_type == "ShaderNodeBsdfPrincipled" else "Color"
            kind = blocks.simple(f"{name} {row}", node_type, **{color: (1.0, 1.0, 1.0)}, **inputs)
            place = (column - 2.5, 0.0, 1.0 - row)
            blocks.place(scene, blocks.sphere(f"{name} {row}", 0.4), kind, place)
    blocks.world(scene, (1.0, 1.0, 1.0))
    made = blocks.camera(scene, (0, -10, 0), (0, 0, 0))
    made.data.type, made.data.ortho_scale = "ORTHO", 6.4
    blocks.finish(scene, 384, 192)


main()
