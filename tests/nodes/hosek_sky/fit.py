#!/usr/bin/python3
"""Fits the formula of Hosek & Wilkie 2012 to what measure.py wrote, and writes engine/shading/hosek_sky_table.cpp.

    tests/nodes/hosek_sky/fit.py SKIES.npz TABLE.cpp

Needs python3-scipy. For each whole turbidity, black and white ground and each of CIE X, Y and Z: first one sky by itself (four
coefficients of the formula are in exponents and powers, the others are linear), then all elevations together, each coefficient
a polynomial of degree 5 over the cube root of the elevation. That leaves the factor of the whole free by a constant, which the
skies between two turbidities or grounds tell, where the coefficients and the factor are mixed apart. Ends with the errors of
the skies by chance: which of several fits alike is found depends on where it began. A plain run was within 3% (turbidity 4.5,
low sun) and mostly within 0.3%; the table in the tree came from the same fits in another order, and is within 0.17% throughout.
"""

import math
import pathlib
import sys

import numpy
import scipy.optimize

k_knots, k_degree, k_turbidities, k_coefficients = 9, 5, 10, 10
k_xyz = numpy.array([[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]])
k_starts = ((-1.1, -0.2, -3, 0.6), (-1.0, -0.3, -1, 0.4), (-1.3, -0.1, -6, 0.7), (-1.05, -0.5, -0.5, 0.5), (-1.1, -0.3, -10, 0.8))
k_exact = 5e-6  # relative error of a fit: the measurement's own
k_least, k_most = numpy.array((-100, -5, -60, -0.95)), numpy.array((50, 2, 5, 0.985))


class Skies:
    """The measured skies as CIE XYZ, and where they were looked at."""

    def __init__(self, path):
        data = numpy.load(path)
        way = data["way"][::2, ::4].reshape(-1, 3).astype(float)
        rgb = data["sky"][:, ::2, ::4].reshape(len(data["sky"]), -1, 3).astype(float)
        self.parameters = data["parameters"]
        self.way, self.rgb, self.xyz = way, rgb, rgb @ k_xyz.T
        self.usable = (rgb > 1e-7).all(-1)  # Blender cuts off what is negative
        theta = numpy.minimum(numpy.arccos(numpy.clip(way[:, 2], -1, 1)), math.pi / 2 - 0.001)
        self.cosine = numpy.cos(theta)

    def to_sun(self, elevation):
        """Cosines of the angles to the sun."""
        return numpy.clip(self.way @ (math.cos(elevation), 0, math.sin(elevation)), -1, 1)


def evaluate(c, cosine, to_sun):
    """Values and derivatives by the ten coefficients (last axis of both) of float[...][10], one leading axis for each sky."""
    a, b, e, h, c0, d, f, g, i, whole = (c[..., n, None] for n in range(k_coefficients))
    gamma = numpy.arccos(to_sun)
    haze, glow = numpy.exp(numpy.clip(b / (cosine + 0.01), -50, 50)), numpy.exp(numpy.clip(e * gamma, -50, 50))
    spread = numpy.maximum(1 + h * h - 2 * h * to_sun, 1e-9)
    rayleigh, mie, zenith = to_sun**2, (1 + to_sun**2) * spread**-1.5, numpy.sqrt(cosine)
    first, second = 1 + a * haze, c0 + d * glow + f * rayleigh + g * mie + i * zenith
    derivatives = (
        haze * second * whole, a / (cosine + 0.01) * haze * second * whole, first * whole * d * gamma * glow,
        first * whole * g * -1.5 * mie / spread * (2 * h - 2 * to_sun), first * whole + 0 * gamma, first * whole * glow,
        first * whole * rayleigh, first * whole * mie, first * whole * zenith, first * second,
    )  # fmt: skip
    return first * second * whole, numpy.stack(numpy.broadcast_arrays(*derivatives), -1)


def fit_one(skies, number, channel, start):
    """Coefficients of one sky, its factor 1."""
    wanted, usable = skies.xyz[number, :, channel], skies.usable[number]
    cosine, to_sun = skies.cosine[usable], skies.to_sun(skies.parameters[number, 2])[usable]

    def linear(exponents):
        columns = evaluate(numpy.array([*exponents, 0, 0, 0, 1, 0, 1.0]), cosine, to_sun)[1][:, 4:9] / wanted[usable, None]
        scale = numpy.linalg.norm(columns, axis=0) + 1e-30
        return numpy.linalg.lstsq(columns / scale, numpy.ones(len(columns)), rcond=1e-10)[0] / scale, columns

    def residual(exponents):
        terms, columns = linear(exponents)
        return columns @ terms - 1

    best = None
    for given in ([start] if start is not None else []) + [numpy.array(s) for s in k_starts]:
        inside = numpy.clip(given, k_least + 1e-6, k_most - 1e-6)
        found = scipy.optimize.least_squares(residual, inside, bounds=(k_least, k_most), x_scale=(1, 0.3, 3, 0.3), max_nfev=150)
        best = found if best is None or found.cost < best.cost else best
        if math.sqrt(2 * best.cost / usable.sum()) < 3e-6:
            break
    return numpy.array([*best.x, *linear(best.x)[0], 1.0])


def bernstein(x):
    """float[x][6]."""
    return numpy.array([[math.comb(k_degree, i) * v**i * (1 - v) ** (k_degree - i) for i in range(k_degree + 1)] for v in x])


def robust_polynomial(basis, values):
    """Bernstein coefficients through most of the values."""
    weights = numpy.ones(len(values))
    for _ in range(30):
        found = numpy.linalg.lstsq(basis * weights[:, None], values * weights, rcond=None)[0]
        weights = 1 / numpy.sqrt(numpy.maximum(abs(basis @ found - values), 1e-6 * abs(values).max() + 1e-12))
    return found


def fit_all(skies, numbers, channel, basis, start, evaluations):
    """float[10][6] of the skies of all elevations together, the mean of its factor 1; (coefficients, relative error)."""
    to_sun = numpy.array([skies.to_sun(skies.parameters[n, 2]) for n in numbers])
    wanted, usable = skies.xyz[numbers, :, channel], skies.usable[numbers]
    inverse = numpy.where(usable, 1 / numpy.where(usable, wanted, 1), 0)
    loose = numpy.eye(6, 60, 54) * 1e-7  # the factor is free together with the terms

    def at(flat):
        return evaluate(basis @ flat.reshape(k_coefficients, 6).T, skies.cosine, to_sun)

    def residual(flat):
        return numpy.append(((at(flat)[0] - wanted) * inverse).ravel(), 1e-7 * (flat[54:] - 1))

    def jacobian(flat):
        return numpy.vstack([numpy.einsum("knq,kb->knqb", at(flat)[1] * inverse[..., None], basis).reshape(-1, 60), loose])

    scale = numpy.repeat(abs(start).max(1) + 1e-3, 6)
    tolerances = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    found = scipy.optimize.least_squares(
        residual, start.ravel(), jac=jacobian, method="lm", x_scale=scale, max_nfev=evaluations, **tolerances
    )
    return scaled(found.x.reshape(k_coefficients, 6), 1 / found.x[54:].mean()), math.sqrt(2 * found.cost / usable.sum())


def scaled(coefficients, by):
    """The same sky with another factor."""
    result = coefficients.copy()
    result[9] *= by
    result[4:9] /= by
    return result


def fit_channel(skies, basis, table, channel):
    """Fills table[:, :, channel]: from the skies by themselves, then from neighbours until all are as exact as the measurement.
    Nearly right is not enough: two skies can be alike while what lies between them is not."""
    errors = numpy.full((k_turbidities, 2), numpy.inf)

    def attempt(t, albedo, start, evaluations):
        found, error = fit_all(skies, [(2 * t + albedo) * k_knots + k for k in range(k_knots)], channel, basis, start, evaluations)
        if error < errors[t, albedo]:
            table[t, albedo, channel], errors[t, albedo] = found, error

    for t in range(k_turbidities):
        for albedo in range(2):
            alone = []
            for k in range(k_knots):
                alone.append(fit_one(skies, (2 * t + albedo) * k_knots + k, channel, alone[-1][:4] if alone else None))
            attempt(t, albedo, numpy.array([robust_polynomial(basis, values) for values in numpy.array(alone).T]), 60)
    for evaluations in (300, 600, 1200):
        for t, albedo in ((t, albedo) for t in reversed(range(k_turbidities)) for albedo in (1, 0)):
            neighbours = [table[n, albedo, channel] for n in (t + 1, t - 1) if 0 <= n < k_turbidities]
            for start in [table[t, albedo, channel], *neighbours, table[t, 1 - albedo, channel]]:
                if errors[t, albedo] > k_exact:
                    attempt(t, albedo, start, evaluations)
    print(f"{'XYZ'[channel]}: relative errors up to {errors.max():.2g}", flush=True)


def with_factor(skies, first, second, numbers, channel):
    """The second coefficients with such a factor that means of both give the skies between them."""

    def error(log_scale):
        sum_of_squares, mean = 0.0, 0.5 * (first + scaled(second, math.exp(log_scale)))
        for n in numbers:
            elevation, usable = skies.parameters[n, 2], skies.usable[n]
            row = (bernstein([variable(elevation)]) @ mean.T)[0]
            value = evaluate(row, skies.cosine, skies.to_sun(elevation))[0]
            sum_of_squares += ((value[usable] / skies.xyz[n, usable, channel] - 1) ** 2).mean()
        return sum_of_squares

    about = min(numpy.linspace(-4, 4, 81), key=error)
    best = scipy.optimize.minimize_scalar(error, bounds=(about - 0.1, about + 0.1), method="bounded", options={"xatol": 1e-10})
    return scaled(second, math.exp(best.x))


def variable(elevation):
    """What coefficients are polynomials of."""
    return (elevation / (math.pi / 2)) ** (1 / 3)


def report(skies, table):
    """Prints how far the skies by chance are off."""
    for n in range(351, len(skies.parameters)):
        turbidity, albedo, elevation = skies.parameters[n]
        below = min(int(turbidity), k_turbidities - 1)
        both = table[below - 1] * (1 - turbidity + below) + table[below] * (turbidity - below)
        rows = bernstein([variable(elevation)]) @ (both[0] * (1 - albedo) + both[1] * albedo).transpose(0, 2, 1)
        xyz = evaluate(rows[:, 0], skies.cosine, skies.to_sun(elevation))[0].T
        rgb = numpy.maximum(xyz @ numpy.linalg.inv(k_xyz).T, 0)
        off = abs(rgb - skies.rgb[n]).max(-1) / skies.rgb[n].max(-1)
        print(f"turbidity {turbidity:.2f} albedo {albedo:.2f} sun {math.degrees(elevation):.2f}: worst {off.max():.4f} mean {off.mean():.5f}")


def write(table, path):
    lines = [
        "// Fitted by tests/nodes/hosek_sky/fit.py to what measure.py there found in Cycles. Not to be edited.",
        '#include "engine/shading/hosek_sky.h"', "", "namespace lambent {", "", "// clang-format off",
        "const HosekCoefficients k_hosek_coefficients[k_hosek_turbidities][2][3] = {",
    ]  # fmt: skip
    for turbidity in table:
        lines.append("    {")
        for ground in turbidity:
            lines.append("        {")
            for channel in ground:
                rows = ["{" + ", ".join(f"{float(v):.7g}".replace("e-0", "e-") for v in row) + "}" for row in channel]
                lines += ["         {{" + ", ".join(rows[:2]) + ","]
                lines += ["           " + ", ".join(rows[i : i + 2]) + "," for i in (2, 4, 6)]
                lines += ["           " + ", ".join(rows[8:]) + "}},"]
            lines.append("        },")
        lines.append("    },")
    pathlib.Path(path).write_text("\n".join([*lines, "};", "// clang-format on", "", "}  // namespace lambent", ""]), encoding="utf-8")


def main():
    skies, basis = Skies(sys.argv[1]), bernstein([0.5 - 0.5 * math.cos(math.pi * k / (k_knots - 1)) for k in range(k_knots)])
    table = numpy.zeros((k_turbidities, 2, 3, k_coefficients, 6))
    for channel in range(3):
        fit_channel(skies, basis, table, channel)
        between = 2 * k_turbidities * k_knots
        for t in range(1, k_turbidities):
            numbers = [between + (t - 1) * k_knots + k for k in range(k_knots)]
            table[t, 0, channel] = with_factor(skies, table[t - 1, 0, channel], table[t, 0, channel], numbers, channel)
        between += (k_turbidities - 1) * k_knots
        for t in range(k_turbidities):
            numbers = [between + t * k_knots + k for k in range(k_knots)]
            table[t, 1, channel] = with_factor(skies, table[t, 0, channel], table[t, 1, channel], numbers, channel)
    report(skies, table)
    write(table, sys.argv[2])


if __name__ == "__main__":
    main()
