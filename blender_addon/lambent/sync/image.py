# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Images: by path where a file holds them, by their bytes where they are packed, by pixels where only Blender has them."""

import os

import bpy
import numpy as np

_ALPHA = {"STRAIGHT": "straight", "PREMUL": "premultiplied", "CHANNEL_PACKED": "channel_packed", "NONE": "none"}
_EXTENSIONS = {"JPEG": ".jpg", "JPEG2000": ".jp2", "OPEN_EXR": ".exr", "OPEN_EXR_MULTILAYER": ".exr", "TARGA": ".tga", "TIFF": ".tif"}


def export_image(edits, image, image_user, tile=None):
    """Puts an image as image_user (or None) shows it, or one UDIM tile of it; returns its id, or None where it holds nothing.

    A file that is missing is put by its path all the same: the daemon names it.
    """
    sequence = image.source in ("SEQUENCE", "MOVIE")
    path = _path(image, image_user) if tile is None else _tile_path(image, tile)
    # Different frames of one sequence are different images.
    identifier = f"{image.name_full}|{os.path.basename(path)}" if sequence or tile is not None else image.name_full
    if edits.contains("image", identifier):
        return identifier
    value = {
        "name": image.name_full,
        "colorspace": image.colorspace_settings.name,
        "alpha": _ALPHA.get(image.alpha_mode, "straight"),
    }
    if image.source == "TILED" and tile is None:
        edits.unsupported(image.name_full, f"{image.name_full}: UDIM tiles of an environment are not supported; the first is used")
    packed = _packed_tile(image, path) if tile is not None else None
    if packed is not None:
        value["encoded"] = edits.array(np.frombuffer(packed.data, np.uint8))
        value["extension"] = os.path.splitext(path)[1].lower()
    elif image.packed_file is not None and not image.is_dirty and image.source != "TILED":
        value["encoded"] = edits.array(np.frombuffer(image.packed_file.data, np.uint8))
        value["extension"] = os.path.splitext(path)[1].lower() or _EXTENSIONS.get(
            image.file_format, "." + image.file_format.lower()
        )
    elif tile is None and (image.source in ("GENERATED", "VIEWER", "MOVIE") or image.is_dirty):
        if not _put_pixels(edits, image, value):
            return None
    elif path:
        value["path"] = path
    else:
        return None
    edits.put("image", identifier, value)
    return identifier


def _path(image, image_user):
    if image_user is not None and image.source in ("SEQUENCE", "MOVIE", "TILED"):
        path = image.filepath_from_user(image_user=image_user)
    else:
        path = image.filepath
    return os.path.normpath(bpy.path.abspath(path, library=image.library)) if path else ""


def _tile_path(image, tile):
    """The file of one tile, its number put where the image's path has the mark for it."""
    row, column = divmod(tile - 1001, 10)
    path = image.filepath.replace("<UDIM>", str(tile)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}")
    return os.path.normpath(bpy.path.abspath(path, library=image.library)) if path else ""


def _packed_tile(image, path):
    """The packed file of a tile, or None: packed files keep the paths that they came from."""
    name = os.path.basename(path)
    return next((item.packed_file for item in image.packed_files if os.path.basename(item.filepath) == name), None)


def _put_pixels(edits, image, value):
    width, height = image.size
    channels = image.channels
    if not width or not height or channels not in (1, 2, 3, 4):
        return False
    pixels = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(pixels)
    value["pixels"] = edits.array(pixels.reshape(height, width, channels))
    if image.is_float:
        # Float buffers hold scene-linear values with alpha multiplied in.
        del value["colorspace"]
        if value["alpha"] == "straight":
            value["alpha"] = "premultiplied"
    return True
