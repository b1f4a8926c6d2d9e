# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""What a viewport has of each pass, and how the values of a pass are shown."""

import numpy as np

# What 16 bits hold. As Cycles does, negative values of passes are shown as 0 and larger ones as this.
_LARGEST_SHOWN = 65504.0
# Pictures that are kept beside Combined: a large window's take 200 MB each.
_MOST_PASSES = 2


def displayed(kind, values):
    """float32[height][width][4], linear and premultiplied, of the values (float32[height][width][1..4]) of a kind of pass.

    As Cycles shows them: as they are, through the view transform like any picture, single numbers as grey, opaque.
    Cryptomattes have a colour for each id, weighted by its share.
    """
    components = values.shape[2]
    pixels = np.ones((*values.shape[:2], 4), np.float32)
    if kind.startswith("cryptomatte_"):
        pixels[..., :3] = sum(_color_of_id(values[..., at]) * values[..., at + 1, None] for at in range(0, components, 2))
    else:
        # Single numbers spread over all three.
        pixels[..., :3] = values[..., : min(components, 3)]
    # fmax and fmin, so that what is no number is 0.
    pixels[..., :3] = np.fmin(np.fmax(pixels[..., :3], 0.0), _LARGEST_SHOWN)
    return pixels


def _color_of_id(ids):
    """float32[..][3] from 0 to 1 of ids, which are float32 by name and any bits in truth."""
    bits = np.ascontiguousarray(ids).view(np.uint32)
    bits = (bits ^ (bits >> np.uint32(16))) * np.uint32(0x45D9F3B)
    bits = bits ^ (bits >> np.uint32(16))
    return np.stack([(bits >> np.uint32(shift)) & np.uint32(0xFF) for shift in (0, 8, 16)], axis=-1) / np.float32(255)


class _Picture:
    """pixels: float32[height][width][4]. samples: int32[height][width] of each pixel. finished: there will be no more."""

    def __init__(self, width, height):
        self.pixels = np.zeros((height, width, 4), np.float32)
        self.samples = np.zeros((height, width), np.int32)
        self.finished = False


class PassPictures:
    """The pictures by pass (None for Combined), all of one scene from one view. Not safe for threads.

    Where a pass is shown again, its picture is still there, and stays until the new render of it has as many samples: Combined
    always, and of the others the last ones.
    """

    def __init__(self):
        self._pictures = {}

    def forget(self, keep=None):
        """The scene or the view is another. The picture of the pass keep remains, to be painted over."""
        kept = self._pictures.get(keep)
        self._pictures = {}
        if kept is not None:
            kept.samples[:] = 0
            kept.finished = False
            self._pictures[keep] = kept

    def add(self, shown, width, height, rect, samples, pixels):
        """Puts float32[rect height][rect width][4] of a tile with that many samples into a picture; whether it changed."""
        picture = self._pictures.get(shown)
        if picture is None or picture.pixels.shape[:2] != (height, width):
            picture = self._pictures[shown] = _Picture(width, height)
            others = [other for other in self._pictures if other is not None]
            for other in others[:-_MOST_PASSES]:
                del self._pictures[other]
        x, y, tile_width, tile_height = rect
        place = np.s_[y : y + tile_height, x : x + tile_width]
        if samples < picture.samples[place].max():
            return False
        picture.pixels[place] = pixels
        picture.samples[place] = samples
        return True

    def finish(self, passes):
        """The pictures of these passes are as good as they get."""
        for shown in passes:
            if shown in self._pictures:
                self._pictures[shown].finished = True

    def is_finished(self, shown):
        """Whether the picture of a pass is as good as it gets."""
        return shown in self._pictures and self._pictures[shown].finished

    def samples(self, shown):
        """How many samples every pixel of a pass has."""
        return int(self._pictures[shown].samples.min()) if shown in self._pictures else 0

    def pixels(self, shown):
        """float32[height][width][4], to be copied, or None where there is nothing of the pass."""
        return self._pictures[shown].pixels if shown in self._pictures else None
