# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Tiles of the wire as numpy arrays, and into Blender's render result."""

import numpy as np

from ..sync import compat
from ..wire.messages import ProtocolError


def decode_tile(header, payload, width, height):
    """((x, y, width, height), {channel name: float32[height][width][components]}) of a `tile` message, views of payload.

    width, height: px of the full frame, which the tile must lie in. Raises ProtocolError for a malformed one.
    """
    rect, channels = header.get("rect"), header.get("channels")
    if not isinstance(rect, list) or len(rect) != 4 or not all(isinstance(side, int) for side in rect):
        raise ProtocolError(f"tile with rectangle {rect}")
    x, y, tile_width, tile_height = rect
    if min(rect) < 0 or 0 in rect[2:] or x + tile_width > width or y + tile_height > height:
        raise ProtocolError(f"tile {rect} lies outside the frame of {width} x {height}")
    starts, total = {}, 0
    for channel in channels if isinstance(channels, list) else ():
        name, components = (channel.get("name"), channel.get("components")) if isinstance(channel, dict) else (None, None)
        if not isinstance(name, str) or not isinstance(components, int) or not 1 <= components <= 4:
            raise ProtocolError(f"tile {rect} with a channel {channel}")
        starts[name] = (total, components)
        total += components
    if not starts or len(payload) != tile_width * tile_height * total * 4:
        raise ProtocolError(f"tile {rect} of {len(payload)} bytes does not hold its channels")
    pixels = np.frombuffer(payload, "<f4").reshape(tile_height, tile_width, total)
    return tuple(rect), {name: pixels[:, :, start : start + count] for name, (start, count) in starts.items()}


class ResultWriter:
    """Writes tiles into the render result of one layer and view, and keeps Blender's tile highlights.

    region: (x0, y0, x1, y1) px of the full frame that Blender keeps; its corner is the result's origin. pass_names: {name of a
    channel on the wire: name of Blender's pass}, which the result has.
    """

    def __init__(self, engine, layer_name, view_name, region, pass_names):
        self._engine = engine
        self._layer_name = layer_name
        self._view_name = view_name
        self._region = region
        self._pass_names = pass_names
        self._highlighted = set()
        engine.use_highlight_tiles = True

    def write(self, rect, channels):
        """Puts {channel name: float32[height][width][components]} at rect (x, y, width, height of the full frame).

        Blender shows it at once. Raises ProtocolError for a channel that was not asked for or has other components.
        """
        local = self._local(rect)
        if local is None:
            return
        x, y, width, height = local
        skip_x, skip_y = x + self._region[0] - rect[0], y + self._region[1] - rect[1]
        engine = self._engine
        result = engine.begin_result(x, y, width, height, layer=self._layer_name, view=self._view_name)
        try:
            # Only the view that is being rendered is in it.
            passes = {found.name: found for found in result.layers[0].passes}
            for name, pixels in channels.items():
                found = passes.get(self._pass_names.get(name))
                if found is None or found.channels != pixels.shape[2]:
                    raise ProtocolError(f"a tile has the channel '{name}' of {pixels.shape[2]} components, which was not asked for")
                compat.write_pass(found, pixels[skip_y : skip_y + height, skip_x : skip_x + width])
        finally:
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
