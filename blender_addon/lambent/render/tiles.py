# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Tiles of the wire as numpy arrays, and into Blender's render result."""

import numpy as np

from ..sync import compat
from ..wire.messages import ProtocolError


def decode_tile(header, payload, width, height):
    """((x, y, width, height), float32[height][width][4]) of a `tile` message's combined channel, as a view of payload.

    width, height: px of the full frame, which the tile must lie in. Raises ProtocolError for a malformed one.
    """
    rect, channels = header.get("rect"), header.get("channels")
    if not isinstance(rect, list) or len(rect) != 4 or not all(isinstance(side, int) for side in rect):
        raise ProtocolError(f"tile with rectangle {rect}")
    x, y, tile_width, tile_height = rect
    if min(rect) < 0 or 0 in rect[2:] or x + tile_width > width or y + tile_height > height:
        raise ProtocolError(f"tile {rect} lies outside the frame of {width} x {height}")
    components, start = 0, None
    for channel in channels if isinstance(channels, list) else ():
        if channel.get("name") == "combined" and channel.get("components") == 4:
            start = components
        components += channel.get("components", 0)
    if start is None or len(payload) != tile_width * tile_height * components * 4:
        raise ProtocolError(f"tile {rect} of {len(payload)} bytes does not hold its channels")
    pixels = np.frombuffer(payload, "<f4").reshape(tile_height, tile_width, components)
    return tuple(rect), pixels[:, :, start : start + 4]


class ResultWriter:
    """Writes tiles into the render result of one layer and view, and keeps Blender's tile highlights.

    region: (x0, y0, x1, y1) px of the full frame that Blender keeps; its corner is the result's origin.
    """

    def __init__(self, engine, layer_name, view_name, region):
        self._engine = engine
        self._layer_name = layer_name
        self._view_name = view_name
        self._region = region
        self._highlighted = set()
        engine.use_highlight_tiles = True

    def write(self, rect, pixels):
        """Puts float32[height][width][4] at rect (x, y, width, height of the full frame); Blender shows it at once."""
        local = self._local(rect)
        if local is None:
            return
        x, y, width, height = local
        skip_x, skip_y = x + self._region[0] - rect[0], y + self._region[1] - rect[1]
        pixels = pixels[skip_y : skip_y + height, skip_x : skip_x + width]
        engine = self._engine
        result = engine.begin_result(x, y, width, height, layer=self._layer_name, view=self._view_name)
        compat.write_pass(result.layers[0].passes[0], pixels)
        engine.end_result(result)

    def highlight(self, rects):
        """Shows which tiles (rectangles of the full frame) are being worked on."""
        wanted = {local for local in (self._local(rect) for rect in rects) if local is not None}
        for local in self._highlighted - wanted:
            self._engine.tile_highlight_set(*local, False)
        for local in wanted - self._highlighted:
            self._engine.tile_highlight_set(*local, True)
        self._highlighted = wanted

    def finish(self):
        """Takes the highlights away."""
        self._engine.tile_highlight_clear_all()
        self._highlighted = set()

    def _local(self, rect):
        """rect cut to the region and relative to it, or None where nothing is left."""
        x0, y0, x1, y1 = self._region
        left, bottom = max(rect[0], x0), max(rect[1], y0)
        right, top = min(rect[0] + rect[2], x1), min(rect[1] + rect[3], y1)
        if left >= right or bottom >= top:
            return None
        return left - x0, bottom - y0, right - left, top - bottom
