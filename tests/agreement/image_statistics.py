"""Do two renderers give the same picture? Per-tile Welch tests on independent batches, and error measures.

A renderer's evidence is `batches`: float[batch][height][width][channel], K pictures with independent random numbers and
equal sample counts. Their mean is the picture, their scatter tells how far it can be off; so no tolerance is chosen.
Limits: K of 6 or more, and tiles wide enough that a tile's mean is near to normally distributed (16x16 as a rule).
"""

import dataclasses

import numpy
from scipy import stats

k_family_error = 0.01  # probability that two renderers which do agree fail a picture
k_tile = 16
# Below this relative difference two renderers differ by their float arithmetic: 24-bit sums of some dozen terms.
k_float_noise = 1e-5
k_margin = 0.01  # what counts as a difference that an artist could care about: 1% of a tile's light


@dataclasses.dataclass
class Comparison:
    """What `compare` found. Ratios are b over a; `failing` is a fraction of all tests (tiles times channels)."""

    mean_ratio: float
    mean_ratio_error: float  # standard error of mean_ratio
    relative_mse: float  # mean of (b - a)^2 / (a^2 + 0.01), noise of both included
    noise_mse_a: float  # the part of relative_mse that the scatter of a's batches explains,
    noise_mse_b: float  # and the scatter of b's
    tests: int
    failing: float  # fraction that differs significantly
    failing_beyond_margin: float  # fraction that differs significantly by more than k_margin
    worst_tile: tuple  # (x, y) of its lower left pixel, row 0 at the bottom as in the arrays
    worst_ratio: float  # b over a in the worst tile
    difference_map: numpy.ndarray  # float[tile rows][tile columns]: (b - a) / a of the tiles, 0 where not significant

    @property
    def noise_mse(self):
        return self.noise_mse_a + self.noise_mse_b

    @property
    def agrees(self):
        return self.failing == 0.0


def tile_means(batches, tile=k_tile):
    """Returns float64[batch][tile rows][tile columns][channel]: means over tiles of tile x tile pixels; those at the
    upper and right edge are smaller."""
    values = numpy.asarray(batches, dtype=numpy.float64)
    rows = numpy.arange(0, values.shape[1], tile)
    columns = numpy.arange(0, values.shape[2], tile)
    sums = numpy.add.reduceat(numpy.add.reduceat(values, rows, axis=1), columns, axis=2)
    heights = numpy.minimum(tile, values.shape[1] - rows)
    widths = numpy.minimum(tile, values.shape[2] - columns)
    return sums / (heights[:, None] * widths[None, :])[None, :, :, None]


def welch(a, b, margin=0.0):
    """Returns two-sided p-values of Welch's unequal-variances test along axis 0, that |mean(b) - mean(a)| is no more than
    `margin` (an array, or 0: that the means are equal). Where neither varies, 1 if they agree within it, else 0."""
    variance_a, variance_b = a.var(axis=0, ddof=1) / len(a), b.var(axis=0, ddof=1) / len(b)
    variance = variance_a + variance_b
    excess = numpy.maximum(numpy.abs(b.mean(axis=0) - a.mean(axis=0)) - margin, 0.0)
    with numpy.errstate(divide="ignore", invalid="ignore"):
        # Welch 1947; the degrees of freedom after Satterthwaite 1946.
        freedom = variance**2 / (variance_a**2 / (len(a) - 1) + variance_b**2 / (len(b) - 1))
        p = 2.0 * stats.t.sf(excess / numpy.sqrt(variance), freedom)
    return numpy.where(variance > 0.0, p, (excess == 0.0).astype(float))


def compare(a, b, tile=k_tile, family_error=k_family_error):
    """Returns the Comparison of two renderers' batches (see the top of this file); a is the reference.

    Each tile and channel is one test at Sidak's level 1 - (1 - family_error)^(1 / tests). Raises ValueError for
    non-finite pixels or shapes that do not match.
    """
    a, b = numpy.asarray(a), numpy.asarray(b)
    if a.shape[1:] != b.shape[1:] or min(len(a), len(b)) < 2:
        raise ValueError(f"cannot compare batches of shapes {a.shape} and {b.shape}")
    for name, values in (("first", a), ("second", b)):
        bad = numpy.count_nonzero(~numpy.isfinite(values))
        if bad:
            raise ValueError(f"{bad} values of the {name} renderer are not finite")

    tiles_a, tiles_b = tile_means(a, tile), tile_means(b, tile)
    mean_a, mean_b = tiles_a.mean(axis=0), tiles_b.mean(axis=0)
    scale = numpy.maximum(numpy.abs(mean_a), numpy.abs(mean_b))
    level = 1.0 - (1.0 - family_error) ** (1.0 / mean_a.size)
    p = welch(tiles_a, tiles_b, k_float_noise * scale)
    significant = p < level
    beyond = welch(tiles_a, tiles_b, k_margin * scale) < level

    # The worst tile: the largest significant difference that matters to the picture, else the smallest p.
    weight = numpy.where(significant.any(), numpy.abs(mean_b - mean_a) * significant, 1.0 - p)
    row, column, channel = numpy.unravel_index(numpy.argmax(weight), weight.shape)
    reference = mean_a[row, column, channel]
    relative = (mean_b - mean_a) / numpy.maximum(scale, 1e-12)

    picture_a, picture_b = a.mean(axis=0, dtype=numpy.float64), b.mean(axis=0, dtype=numpy.float64)
    denominator = picture_a**2 + 0.01
    scatter_a = a.var(axis=0, ddof=1, dtype=numpy.float64) / len(a)
    scatter_b = b.var(axis=0, ddof=1, dtype=numpy.float64) / len(b)
    whole_a = a.reshape(len(a), -1).mean(axis=1, dtype=numpy.float64)
    whole_b = b.reshape(len(b), -1).mean(axis=1, dtype=numpy.float64)
    ratio = whole_b.mean() / whole_a.mean() if whole_a.mean() != 0.0 else float("nan")
    # First-order error of a quotient of independent means.
    error = numpy.hypot(
        whole_b.std(ddof=1) / numpy.sqrt(len(b)), ratio * whole_a.std(ddof=1) / numpy.sqrt(len(a))
    ) / abs(whole_a.mean() or float("nan"))
    return Comparison(
        mean_ratio=float(ratio),
        mean_ratio_error=float(error),
        relative_mse=float(((picture_b - picture_a) ** 2 / denominator).mean()),
        noise_mse_a=float((scatter_a / denominator).mean()),
        noise_mse_b=float((scatter_b / denominator).mean()),
        tests=int(mean_a.size),
        failing=float(significant.mean()),
        failing_beyond_margin=float(beyond.mean()),
        worst_tile=(int(column * tile), int(row * tile)),
        worst_ratio=float(mean_b[row, column, channel] / reference) if reference != 0.0 else float("inf"),
        difference_map=numpy.where(significant, relative, 0.0).mean(axis=2),
    )
