"""The statistics behind the comparison with Cycles find what is there and nothing else."""

import pathlib
import sys

import numpy
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import image_statistics

k_shape = (8, 72, 104, 3)  # batches, height, width, channels; not whole tiles


def rendered(seed, bias=1.0, spikes=0.0):
    """Batches of a made-up renderer: a gradient with gamma noise (as positive and as skewed as path tracing's), and a
    fraction of `spikes`: rare paths that hold a fifth of the light."""
    random = numpy.random.default_rng(seed)
    height, width = k_shape[1:3]
    truth = 0.05 + numpy.linspace(0, 1, width)[None, :, None] * numpy.linspace(0.2, 1, height)[:, None, None]
    truth = truth * numpy.array([1.0, 0.7, 0.4])
    noise = random.gamma(2.0, 0.5, k_shape)
    if spikes:
        noise = 0.8 * noise + 0.2 * random.binomial(1, spikes, k_shape) / spikes
    return (truth * bias * noise).astype(numpy.float32)


@pytest.mark.parametrize("seed", range(5))
def test_equal_renderers_agree(seed):
    found = image_statistics.compare(rendered(2 * seed), rendered(2 * seed + 1))
    assert found.agrees
    assert abs(found.mean_ratio - 1.0) < 4 * found.mean_ratio_error


def quiet(seed):
    """Batches of the same picture with a thirtieth of the noise."""
    return 0.97 * rendered(1).mean(axis=0) + 0.03 * rendered(seed)


def test_noise_explains_the_error_between_equal_renderers():
    found = image_statistics.compare(quiet(3), quiet(4))
    # 22,464 squared differences: a relative standard error of sqrt(2 / 22464) = 0.9%, and some skew.
    assert found.relative_mse == pytest.approx(found.noise_mse, rel=0.05)


def test_family_error_is_kept_with_spiky_noise():
    failed = sum(
        not image_statistics.compare(rendered(1000 + s, spikes=0.01), rendered(2000 + s, spikes=0.01)).agrees
        for s in range(100)
    )
    assert failed <= 5  # 1 expected at a family error of 0.01; P(more than 5) is 0.0005


def test_two_percent_bias_is_found():
    found = image_statistics.compare(rendered(1), rendered(2, bias=1.02))
    assert found.mean_ratio == pytest.approx(1.02, abs=4 * found.mean_ratio_error)
    assert abs(found.mean_ratio - 1.0) > 4 * found.mean_ratio_error
    assert image_statistics.compare(rendered(1)[:, :16, :16], rendered(1)[:, :16, :16]).agrees


def test_two_percent_bias_is_found_tile_by_tile_at_low_noise():
    assert image_statistics.compare(quiet(1), quiet(2)).agrees
    found = image_statistics.compare(quiet(1), 1.02 * quiet(2))
    assert found.failing > 0.9
    assert found.failing_beyond_margin > 0.5
    assert image_statistics.compare(quiet(1), 1.008 * quiet(2)).failing_beyond_margin == 0.0


def test_bias_in_one_tile_is_found_and_located():
    a, b = rendered(1), rendered(2)
    b[:, 32:48, 64:80] *= 1.25
    found = image_statistics.compare(a, b)
    assert not found.agrees
    assert found.worst_tile == (64, 32)
    assert found.worst_ratio == pytest.approx(1.25, rel=0.1)


def test_constant_tiles_agree_only_if_equal():
    a = numpy.full(k_shape, 0.5, numpy.float32)
    assert image_statistics.compare(a, a * numpy.float32(1 + 2e-6)).agrees
    assert image_statistics.compare(a, a * numpy.float32(1.001)).failing == 1.0


def test_non_finite_pixels_are_refused():
    a, b = rendered(1), rendered(2)
    b[3, 5, 7, 1] = numpy.nan
    with pytest.raises(ValueError, match="second renderer"):
        image_statistics.compare(a, b)


def test_welch_matches_the_closed_form_of_two_degrees_of_freedom():
    # Means 1 and 4, variance 2 each, so t = 3 / sqrt(2) at 2 degrees of freedom, where p = 1 - t / sqrt(t^2 + 2).
    t = 3 / 2**0.5
    p = image_statistics.welch(numpy.array([0.0, 2.0]), numpy.array([3.0, 5.0]))
    assert p == pytest.approx(1 - t / (t * t + 2) ** 0.5, rel=1e-9)
    assert image_statistics.welch(numpy.array([0.0, 2.0]), numpy.array([3.0, 5.0]), 3.0) == 1.0
