"""Known differences are bounded, and what chance explains does not count. Without Blender."""

import pathlib
import sys

import numpy
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import compare
import known_differences

CASE = {"node": "BsdfToon", "options": {}, "variant": "rim", "output": ""}


def verdict(sure, mean_sure):
    return compare.Verdict(CASE, False, sure, 0.1, sure, mean_sure)


@pytest.fixture
def measured(monkeypatch):
    known = {3: {"it differs": {"BsdfToon[rim].": (2.0, 0.5)}}, 5: {}}
    monkeypatch.setattr(known_differences, "k_measured", known)


def test_a_difference_is_known_up_to_its_bounds_in_the_version_that_it_was_measured_in(measured):
    assert known_differences.reason(verdict(0.019, 0.004), "3.4.1") == "it differs"
    assert known_differences.reason(verdict(0.019, 0.004), "2.93") == "it differs"
    assert known_differences.reason(verdict(0.021, 0.004), "3.4.1") == ""
    assert known_differences.reason(verdict(0.019, 0.006), "3.4.1") == ""
    assert known_differences.reason(verdict(0.5, 0.5), "3.4.1", bounded=False) == "it differs"
    assert known_differences.reason(verdict(0.001, 0.0), "5.2.2") == ""
    assert known_differences.reason(verdict(0.001, 0.0), "6.0") == ""


def test_every_measured_difference_has_bounds_and_a_reason():
    for versions in known_differences.k_measured.values():
        labels = [label for cases in versions.values() for label in cases]
        assert len(labels) == len(set(labels))
        for why, cases in versions.items():
            assert why
            for largest, mean in cases.values():
                assert 0.0 < largest < 500.0 and 0.0 <= mean < 100.0


def test_noise_alone_is_not_beyond_chance_and_a_shift_is():
    generator = numpy.random.default_rng(3)
    a, b = generator.normal(1.0, 0.1, (2, 8, 1000))
    assert (compare.beyond_chance(a, b) > 0.0).mean() < 0.01
    beyond = compare.beyond_chance(a, b + 1.0)
    assert beyond.mean() == pytest.approx(1.0 - 6.0 * 0.1 * (2 / 8) ** 0.5, abs=0.05)
