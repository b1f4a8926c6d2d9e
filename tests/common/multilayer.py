"""Multi-layer EXR files as Blender and `lambent` write them, and what their passes must add up to."""

import json

import numpy
import OpenImageIO as oiio

# The letters that Blender names channels by, in their order, for the sets of letters that occur.
k_orders = ("RGBA", "rgba", "RGB", "XYZW", "XYZ", "UVA", "X", "Z", "V")
# Short names of before Blender 5.0: long ones.
k_long_names = {
    "IndexOB": "Object Index",
    "IndexMA": "Material Index",
    "DiffDir": "Diffuse Direct",
    "DiffInd": "Diffuse Indirect",
    "DiffCol": "Diffuse Color",
    "GlossDir": "Glossy Direct",
    "GlossInd": "Glossy Indirect",
    "GlossCol": "Glossy Color",
    "TransDir": "Transmission Direct",
    "TransInd": "Transmission Indirect",
    "TransCol": "Transmission Color",
    "VolumeDir": "Volume Direct",
    "VolumeInd": "Volume Indirect",
    "Emit": "Emission",
    "Env": "Environment",
    "AO": "Ambient Occlusion",
}


def read(path, long_names=True):
    """Returns ({layer: {pass: float32[height][width][channel]}}, {attribute: value}), row 0 at the bottom.

    long_names: passes go by the names of Blender 5, whatever version wrote them. A channel without a layer is of layer "", and
    R, G, B, A alone are the pass "Combined".
    """
    image = oiio.ImageBuf(str(path))
    planes, attributes = {}, {}
    for part in range(image.nsubimages):
        image.reset(str(path), part, 0)
        pixels = image.get_pixels(oiio.FLOAT)
        if image.has_error or pixels is None:
            raise OSError(f"{path}: {image.geterror()}")
        spec = image.spec()
        attributes.update((attribute.name, attribute.value) for attribute in spec.extra_attribs)
        for index, name in enumerate(spec.channelnames):
            layer, pass_name, letter = split_channel(name)
            pass_name = k_long_names.get(pass_name, pass_name) if long_names else pass_name
            planes.setdefault(layer, {}).setdefault(pass_name, {})[letter] = pixels[::-1, :, index]
    layers = {layer: {name: _in_order(found) for name, found in passes.items()} for layer, passes in planes.items()}
    return layers, attributes


def split_channel(name):
    """Returns (layer, pass, letter) of a channel's name: "Layer.Pass.R", "Pass.R" or "R". Names may hold points."""
    path, _, letter = name.rpartition(".")
    layer, _, pass_name = path.partition(".")
    if not pass_name:
        layer, pass_name = "", layer or "Combined"
    return layer, pass_name, letter


def _in_order(found):
    order = next((order for order in k_orders if set(order) == set(found)), sorted(found))
    return numpy.ascontiguousarray(numpy.stack([found[letter] for letter in order], axis=2))


def sum_error(total, passes, film_transparent):
    """Returns float64[height][width][3]: by how much a sum of passes differs from Combined, relative to it. With a transparent
    film what the camera sees of the world is in the passes (as in Cycles) and not in Combined."""
    expected = passes["Combined"][..., :3].astype(numpy.float64)
    if film_transparent:
        expected += passes["Environment"]
    return numpy.abs(total - expected) / numpy.maximum(numpy.abs(expected), 1e-3)


def light_sum(passes):
    """Returns float64[height][width][3]: the sum of a layer's light passes, colours multiplied in."""
    total = numpy.zeros_like(passes["Combined"][..., :3], dtype=numpy.float64)
    for kind in ("Diffuse", "Glossy", "Transmission"):
        light = passes[f"{kind} Direct"].astype(numpy.float64) + passes[f"{kind} Indirect"]
        total += light * passes[f"{kind} Color"]
    for name in ("Volume Direct", "Volume Indirect", "Emission", "Environment"):
        total += passes.get(name, 0.0)
    return total


def group_sum(passes):
    """Returns float64[height][width][3]: the sum of a layer's light groups."""
    return sum(passes[name].astype(numpy.float64) for name in passes if name.startswith("Combined_"))


def manifest(attributes, layer, kind):
    """Returns {name: id as float32} of the Cryptomatte "CryptoObject", "CryptoMaterial" or "CryptoAsset" of a layer."""
    for name, value in attributes.items():
        if name.startswith("cryptomatte/") and name.endswith("/name") and value == (f"{layer}.{kind}" if layer else kind):
            text = attributes[name[: -len("name")] + "manifest"]
            return {key: numpy.array([int(bits, 16)], numpy.uint32).view(numpy.float32)[0] for key, bits in json.loads(text).items()}
    raise ValueError(f"no manifest of {layer}.{kind}")


def coverage(passes, kind, identity):
    """Returns float32[height][width]: how much of each pixel the id covers, over all levels of a Cryptomatte."""
    found = 0.0
    for name in sorted(name for name in passes if name.startswith(kind)):
        levels = passes[name]
        for rank in (0, 2):
            found = found + numpy.where(levels[..., rank] == identity, levels[..., rank + 1], 0.0)
    return found
