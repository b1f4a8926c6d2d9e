# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender 3.4: measures Cycles' Blackbody node and writes engine/shading/blackbody_table.cpp.

    blender -b --factory-startup --python-exit-code 1 --python tests/nodes/measure_blackbody.py -- TABLE.cpp

Colours are linear Rec. 709, at temperatures that are even in their logarithm from 800 to 12000 K, then one below and one above, where
Cycles' colour is the same for all. Each temperature is a face, one pixel each; 1 is added to its colour, since what is below 0 is cut
off, so values are good to a unit in the last place of that.
"""

import pathlib
import sys

import bpy
import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from faces_in_cycles import Faces

k_cells, k_low, k_high = 256, 800.0, 12000.0
k_beyond = (400.0, 30000.0)
k_width = 37  # of the picture, px

k_head = """// Measured by tests/nodes/measure_blackbody.py in Cycles. Not to be edited.
#include "engine/shading/blackbody_table.h"

namespace lambent {

// clang-format off
"""


def temperatures():
    """float64[259]."""
    return numpy.concatenate([k_low * (k_high / k_low) ** (numpy.arange(k_cells + 1) / k_cells), k_beyond])


def material():
    """Emission of 1 more than the black body's colour at the face's temperature."""
    made = bpy.data.materials.new("Black body")
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    attribute, body, add = nodes.new("ShaderNodeAttribute"), nodes.new("ShaderNodeBlackbody"), nodes.new("ShaderNodeVectorMath")
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    attribute.attribute_name, add.inputs[1].default_value = "kelvin", (1, 1, 1)
    for begin, end in (
        (attribute.outputs["Fac"], body.inputs["Temperature"]),
        (body.outputs["Color"], add.inputs[0]),
        (add.outputs["Vector"], emission.inputs["Color"]),
        (emission.outputs["Emission"], output.inputs["Surface"]),
    ):
        links.new(begin, end)
    return made


def rows(colours):
    """C++ initialisers of colours, four a line."""
    texts = ["{" + ", ".join(f"{value:.7g}f" if "." in f"{value:.7g}" else f"{value:.1f}f" for value in colour) + "}" for colour in colours]
    return "".join("    " + ", ".join(texts[n : n + 4]) + ",\n" for n in range(0, len(texts), 4))


def main():
    colours = Faces("kelvin", temperatures(), k_width, material).render().astype(float) - 1.0
    table, (below, above) = colours[: k_cells + 1], colours[k_cells + 1 :]
    text = k_head + f"const BlackbodyTable k_blackbody_table = {{\n  {{\n{rows(table)}  }},\n"
    text += f"{rows([below])}{rows([above])}}};\n// clang-format on\n\n}}  // namespace lambent\n"
    pathlib.Path(sys.argv[sys.argv.index("--") + 1]).write_text(text, encoding="utf-8")


main()
