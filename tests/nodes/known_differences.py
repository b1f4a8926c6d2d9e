"""Differences from Cycles that are known, with their reasons: cases that differ otherwise fail the comparison."""

import re

# (pattern of the case's label, reason); the first that matches counts, of k_known or else of the version's own list
k_known = [
    # Not done yet; Lambent names these in its report
    (r"^BsdfHairPrincipled", "not done: a diffuse surface stands in"),
    (r"^TexSky\[HOSEK_WILKIE", "not done: Preetham's model stands in"),
    (r"^Squeeze", "not done: grey"),
    (r"^RadialTiling", "not done: grey"),
    (r"^TexCoord\[Reflection|^TexImage\[mapping inside", "half a percent in few places, not explained"),
    (r"^Bevel", "the mean of a few probes depends on how their axes are turned, which is otherwise in Cycles"),
    # Chosen
    (r"^NewGeometry\[Random Per Island", "islands have other random numbers"),
    (r"^Blackbody", "Cycles fits curves to the colour; Lambent integrates Planck's law"),
    (r"^LightPath\[Ray Length", "Cycles 3.4 counts from the near clipping plane, Lambent from the camera"),
    (r"^Tangent\[UV_MAP", "tangents are Lambent's own per triangle, Blender's come from quads"),
    (r"^TexImage\[.*(Cubic|Smart)|^TexEnvironment\[.*(Cubic|Smart)", "bicubic weights differ by up to half a percent"),
    # What Cycles does that looks like a fault of its own
    (r"^BsdfHair\[", "on a surface Cycles lets light in from below it"),
]

k_before_4 = [
    (r"^Bump", "up to 5% where the height bends most, not explained"),
    (r"MULTI_GGX", "Lambent scales single scattering (Turquin 2019), Cycles 3.4 walks in the microsurface"),
    (r"^TexSky\[NISHITA", "Lambent's integral over the atmosphere is up to 1% off Cycles' table"),
    (r"^Bsdf(Glass|Refraction)\[(GGX|BECKMANN|index)", "Cycles 3.4 keeps rough refraction that leaves on the wrong side, and adds "
     "light to refraction of index 1"),  # fmt: skip
    (r"^BsdfAnisotropic\[BECKMANN", "Cycles 3.4 loses most of the sky's light in this lobe"),
    (r"^BsdfPrincipled.*coat", "Cycles 3.4 samples GGX normals for the coat but counts with the density of GTR1 ones"),
    (r"^BsdfToon", "Cycles 3.4 takes a sampled direction's angle for another in the fading rim, and lights beyond the cone"),
    (r"^NormalMap\[BLENDER_(OBJECT|WORLD) strength 1", "normals that point away from the view are bent back otherwise"),
]  # fmt: skip

k_since_4 = [
    (r"^BsdfSheen|^BsdfPrincipled\[sheen", "fits of the tables that Cycles has (Zeltner et al. 2022)"),
    (r"^BsdfPrincipled\[thin", "not done: thin films and thin walls"),
    (r"^Bsdf(Glass|Refraction)\[", "Cycles counts refraction at facets that face away, and blurs what index 1 does"),
    (r"^TexImage\[float pattern.Color", "float images with alpha, not explained"),
    (r"^SubsurfaceScattering\[RANDOM_WALK", "up to 10% in few places, at this sphere's edge, not explained"),
    (r"^BsdfTranslucent|^TexEnvironment\[EQUIRECTANGULAR Linear", "about a percent in few places, not explained"),
    (r"^TexNoise\[15 octaves", "Cycles 5 repeats noise every 100000 units, which the finest octaves reach"),
    (r"^TexWhiteNoise", "Cycles 5 rounds a number that comes from an attribute, and the hash tells"),
    (r"^Wavelength", "the matrix from XYZ is that of Blender 3.4"),
]


def reason(case, blender):
    """Why a case may differ in that version of Blender ("3.4.1"), or ""."""
    from compare import label

    own = k_before_4 if int(blender.split(".")[0]) < 4 else k_since_4
    return next((why for pattern, why in k_known + own if re.search(pattern, label(case))), "")
