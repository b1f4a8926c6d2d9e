"""Verdicts of node cases from the two engines' pictures."""

import dataclasses
import json
import pathlib
import sys

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "agreement"))
import blender_runs
import image_statistics

# Noises move coordinates by up to 200, where a float resolves 1.5e-5, and are a few times as steep: what the two engines round
# differently there is the largest rounding that values may show, as a part of the largest value of the patch.
k_rounding = 1e-4
k_false_alarms = 1e-3  # probability that a case of two engines that agree fails


@dataclasses.dataclass
class Verdict:
    """What was found of one case. `difference`: the largest, as a part of the patch's largest value (at least 1) or, of surfaces,
    of the case's mean. `sure` and `mean_sure`: what of the largest difference and of that of the means chance does not explain."""

    case: dict
    agrees: bool
    difference: float
    differing: float  # fraction of the patch's values beyond rounding
    sure: float
    mean_sure: float = 0.0
    note: str = ""


def read_cases(folder, kind):
    with open(f"{folder}/{kind}.json", encoding="utf-8") as file:
        return json.load(file)


def pictures(folder, kind, engine, seeds):
    """float32[seed][height][width][3], row 0 at the bottom."""
    return numpy.stack([blender_runs.read_picture(f"{folder}/{kind}_{engine}_{seed}.exr")[..., :3] for seed in seeds])


def patch_of(batches, found, index):
    """The batches' pixels of case `index`: float[seed][patch][patch][3]."""
    size = found["patch"]
    x, y = index % found["columns"] * size, index // found["columns"] * size
    return batches[:, y : y + size, x : x + size]


def value_verdicts(folder):
    """[Verdict] of the value cases rendered into a folder.

    A face whose value already changes between two seeds of one engine by more than rounding sits on a discontinuity of the
    case (the seeds differ in where in the face they look, so in the rounding of its inputs): both engines' ranges must meet.
    """
    found = read_cases(folder, "value")
    cycles = pictures(folder, "value", "cycles", (1, 2)).astype(numpy.float64)
    lambent = pictures(folder, "value", "lambent", (1, 2)).astype(numpy.float64)
    verdicts = []
    for index, case in enumerate(found["cases"]):
        a, b = patch_of(cycles, found, index), patch_of(lambent, found, index)
        scale = max(1.0, float(numpy.abs(a).max()))
        # The distance between the intervals that the seeds of each engine span.
        gap = numpy.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0)).clip(0.0) / scale
        beyond = gap > k_rounding
        verdicts.append(Verdict(case, not beyond.any(), float(gap.max()), float(beyond.mean()), float(gap.max())))
    return verdicts


def surface_verdicts(folder, kind):
    """[Verdict] of the surface cases: a Welch test on each tile of 4 x 4 pixels and channel, with one false alarm in a
    thousand cases that agree. `difference` is the largest significant one as a part of the case's mean, or 0."""
    found = read_cases(folder, kind)
    cycles, lambent = (
        image_statistics.tile_means(pictures(folder, kind, engine, range(1, 9)), tile=4) for engine in ("cycles", "lambent")
    )
    size = found["patch"] // 4
    verdicts = []
    for index, case in enumerate(found["cases"]):
        x, y = index % found["columns"] * size, index // found["columns"] * size
        a, b = (batches[:, y : y + size, x : x + size] for batches in (cycles, lambent))
        scale = max(float(numpy.abs(a).mean()), 1e-3)
        p = image_statistics.welch(a, b, k_rounding * scale)
        significant = p < 1.0 - (1.0 - k_false_alarms) ** (1.0 / p.size)
        differences = numpy.where(significant, numpy.abs(b.mean(axis=0) - a.mean(axis=0)), 0.0) / scale
        sure = numpy.where(significant, beyond_chance(a, b), 0.0).max() / scale
        mean_sure = beyond_chance(a.mean(axis=(1, 2, 3)), b.mean(axis=(1, 2, 3))) / scale
        verdicts.append(
            Verdict(case, not significant.any(), float(differences.max()), float(significant.mean()), float(sure), float(mean_sure))
        )
    return verdicts


def beyond_chance(a, b):
    """How far apart the means over the first axis are, less six standard errors (of eight pictures, in some 50 tiles); not below 0."""
    error = numpy.sqrt(a.var(axis=0, ddof=1) / len(a) + b.var(axis=0, ddof=1) / len(b))
    return (numpy.abs(b.mean(axis=0) - a.mean(axis=0)) - 6.0 * error).clip(0.0)


def verdicts_of(folder, kind):
    return value_verdicts(folder) if kind == "value" else surface_verdicts(folder, kind)


def label(case):
    options = ", ".join(f"{key} {item}" for key, item in case["options"].items())
    return f"{case['node']}[{', '.join(part for part in (options, case['variant']) if part)}].{case['output']}"


if __name__ == "__main__":
    for kind in sys.argv[2:]:
        results = verdicts_of(sys.argv[1], kind)
        for verdict in results:
            if not verdict.agrees:
                print(f"{label(verdict.case)}: {verdict.difference:.2g} in {100 * verdict.differing:.0f}%, mean {verdict.mean_sure:.2g}")
        print(sum(verdict.agrees for verdict in results), "of", len(results), "agree")
