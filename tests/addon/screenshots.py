# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What Xvfb shows, looked at by the tests and, while it runs, by the scripts inside Blender."""

import pathlib
import struct

import numpy as np


def read_screenshot(path):
    """float32[height][width][3] of a screenshot (an XWD file of 32 bits a pixel), row 0 at the top."""
    content = pathlib.Path(path).read_bytes()
    header = struct.unpack(">25I", content[:100])
    header_bytes, width, height, line_bytes, colours = header[0], header[4], header[5], header[12], header[19]
    rows = np.frombuffer(content, np.uint8, height * line_bytes, header_bytes + 12 * colours).reshape(height, line_bytes)
    return rows[:, : width * 4].reshape(height, width, 4)[..., 2::-1].astype(np.float32) / 255


def orange_pixels(pixels):
    """How many pixels of a screenshot are Blender's colour of tiles being worked on."""
    red, green, blue = pixels[..., 0], pixels[..., 1], pixels[..., 2]
    return int(((red > 0.8) & (green > 0.3) & (green < 0.75) & (blue < 0.45)).sum())


def gradient_pixels(pixels):
    """How many pixels of a screenshot look like the fake daemon's picture (its blue is 0.5 everywhere)."""
    blue = pixels[..., 2]
    colourful = np.abs(pixels[..., 0] - pixels[..., 1]) > 0.15
    return int(((np.abs(blue - 0.5) < 0.02) & colourful).sum())
