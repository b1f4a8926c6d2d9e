"""Differences from Cycles that are known: why, and how large each may be. A case that differs otherwise, or by more, fails.

By the major version of Blender that it was measured with: {why: {case: (largest, mean)}}, in percent. `largest` bounds the
difference of a tile as a part of the case's mean (values: of a face, of the largest value), `mean` that of the means; each a
third more than measured, what chance may explain left out (compare.beyond_chance).
"""

# 3.4.1
k_blender_3 = {
    "Cycles leaves this node out, as if what it leads to had no link; Lambent names it and takes grey": {
        "Squeeze[].Value": (65, 0),
    },
    "rounding, of single precision in the fit and the tables of the sky": {
        "TexSky[PREETHAM].": (0.029, 0.11),
    },
    "Cycles counts from the near clipping plane, Lambent from the camera": {
        "LightPath[Ray Length].": (0.26, 0.2),
    },
    "under uneven scale the normal that Cycles takes back to object space is not of unit length": {
        "NormalMap[as a value].": (0.41, 0.16),
    },
    "of images that Blender holds Cycles multiplies the bytes by alpha and rounds them down": {
        "TexImage[pattern.Color].": (0.65, 0.24),
    },
    "Lambent scales single scattering (Turquin 2019), Cycles 3.4 walks in the microsurface": {
        "BsdfAnisotropic[MULTI_GGX anisotropy -0.6 rotation 0.0].": (40, 3.1),
        "BsdfAnisotropic[MULTI_GGX anisotropy 0.7 rotation 0.0].": (42, 6.7),
        "BsdfAnisotropic[MULTI_GGX anisotropy 0.7 rotation 0.2].": (53, 5.6),
        "BsdfGlass[MULTI_GGX roughness 0.2].": (21, 2.4),
        "BsdfGlass[MULTI_GGX roughness 0.5].": (23, 4.7),
        "BsdfGlass[MULTI_GGX roughness 1.0].": (71, 6.5),
        "BsdfGlossy[MULTI_GGX roughness 0.5].": (22, 0.64),
        "BsdfGlossy[MULTI_GGX roughness 1.0].": (35, 6.6),
        "BsdfPrincipled[anisotropic metal (MULTI_GGX)].": (14, 2.2),
        "BsdfPrincipled[half metal (MULTI_GGX)].": (2.3, 0.47),
        "BsdfPrincipled[rough (MULTI_GGX)].": (2.3, 0.57),
        "BsdfPrincipled[rough coat (MULTI_GGX)].": (3, 0.54),
        "BsdfPrincipled[rough glass (MULTI_GGX)].": (16, 9.8),
        "BsdfPrincipled[rough metal (MULTI_GGX)].": (4.4, 0.31),
        "BsdfPrincipled[sheen (MULTI_GGX)].": (2.9, 0.59),
        "BsdfPrincipled[strong specular (MULTI_GGX)].": (2.2, 0.4),
    },
    "Cycles 3.4 keeps rough refraction that leaves on the wrong side, and adds light to refraction of index 1": {
        "BsdfGlass[BECKMANN roughness 1.0].": (6.1, 1.6),
        "BsdfGlass[GGX roughness 0.5].": (6, 2.7),
        "BsdfGlass[GGX roughness 1.0].": (43, 7.1),
        "BsdfGlass[index 0.8].": (1.8, 0.5),
        "BsdfGlass[index 1].": (3.5, 1.5),
        "BsdfRefraction[BECKMANN roughness 1.0].": (8.3, 2.7),
        "BsdfRefraction[GGX roughness 0.2].": (0.36, 0.26),
        "BsdfRefraction[GGX roughness 0.5].": (18, 4.7),
        "BsdfRefraction[GGX roughness 1.0].": (60, 9.3),
        "BsdfRefraction[index 0.8].": (2.9, 1.3),
        "BsdfRefraction[index 1].": (3.4, 1.5),
        "BsdfRefraction[index 2.4].": (2.8, 0.88),
    },
    "Cycles 3.4 keeps rough refraction that leaves on the wrong side": {
        "BsdfPrincipled[rough glass (GGX)].": (3.7, 1.5),
    },
    (
        "where a sampled half vector lies behind the view Cycles turns it, but not its cosine, so that it reflects "
        "where its density does not say: too much at grazing angles (roughness 1 at 70 degrees: 0.37 of the light for "
        "0.30)"
    ): {
        "BsdfAnisotropic[ASHIKHMIN_SHIRLEY anisotropy 0.7 rotation 0.0].": (1.3, 0.65),
        "BsdfAnisotropic[ASHIKHMIN_SHIRLEY anisotropy 0.7 rotation 0.2].": (0.29, 0.16),
        "BsdfGlossy[ASHIKHMIN_SHIRLEY roughness 1.0].": (2.7, 0.61),
    },
    "Cycles 3.4 loses most of the sky's light in this lobe": {
        "BsdfAnisotropic[BECKMANN anisotropy -0.6 rotation 0.0].": (320, 44),
        "BsdfAnisotropic[BECKMANN anisotropy 0.7 rotation 0.0].": (66, 0.97),
        "BsdfAnisotropic[BECKMANN anisotropy 0.7 rotation 0.2].": (25, 1.5),
    },
    "Cycles 3.4 samples GGX normals for the coat but counts with the density of GTR1 ones": {
        "BsdfPrincipled[coat (GGX)].": (5.5, 0.82),
        "BsdfPrincipled[rough coat (GGX)].": (1.4, 0.19),
    },
    "Cycles 3.4 takes a sampled direction's angle for another in the fading rim, and lights beyond the cone": {
        "BsdfToon[DIFFUSE size 0.1 smooth 0.1].": (110, 14),
        "BsdfToon[DIFFUSE size 0.5 smooth 0.3].": (12, 4.5),
        "BsdfToon[DIFFUSE size 0.9 smooth 0.5].": (2.7, 0.89),
        "BsdfToon[GLOSSY size 0.1 smooth 0.1].": (87, 12),
        "BsdfToon[GLOSSY size 0.5 smooth 0.3].": (14, 3.2),
        "BsdfToon[GLOSSY size 0.9 smooth 0.5].": (48, 13),
    },
    "on a surface Cycles lets light in from below it": {
        "BsdfHair[Reflection roughness 0.1].": (32, 13),
        "BsdfHair[Reflection roughness 0.5].": (30, 13),
        "BsdfHair[Transmission roughness 0.1].": (52, 18),
        "BsdfHair[Transmission roughness 0.5].": (75, 20),
    },
    (
        "Cycles samples the coat's reflection as wide as without a coat, but counts with its density: a clear hair in "
        "white light shows 1.015"
    ): {
        "BsdfHairPrincipled[ABSORPTION coat].": (6.3, 2.4),
        "BsdfHairPrincipled[COLOR coat].": (8.1, 2.9),
        "BsdfHairPrincipled[MELANIN coat].": (7.7, 2.5),
    },
    "Cycles 3.4 turns what it has sampled by the tilt (2 degrees by default), but counts with the density from before": {
        "BsdfHairPrincipled[ABSORPTION pale].": (0.97, 0.11),
        "BsdfHairPrincipled[ABSORPTION rough].": (0.37, 0.11),
        "BsdfHairPrincipled[ABSORPTION tilted].": (5.9, 0.4),
        "BsdfHairPrincipled[ABSORPTION].": (2.5, 0.18),
        "BsdfHairPrincipled[COLOR pale].": (3.6, 0.24),
        "BsdfHairPrincipled[COLOR rough].": (0.86, 0.15),
        "BsdfHairPrincipled[COLOR tilted].": (5.6, 0.56),
        "BsdfHairPrincipled[COLOR].": (0.95, 0.18),
        "BsdfHairPrincipled[MELANIN pale].": (0.68, 0.14),
        "BsdfHairPrincipled[MELANIN rough].": (3.5, 0.48),
        "BsdfHairPrincipled[MELANIN tilted].": (4.2, 0.5),
        "BsdfHairPrincipled[MELANIN].": (2.3, 0.29),
    },
    "not explained: 0.1 to 0.3 percent darker, where spheres cast shadows": {
        "NormalMap[BLENDER_WORLD strength 1.0].": (0.31, 0.21),
    },
}  # fmt: skip

# 4.3.2
k_blender_4 = {
    "Cycles leaves this node out, as if what it leads to had no link; Lambent names it and takes grey": {
        "Squeeze[].Value": (65, 0),
    },
    "rounding: distortion and the offsets of colours, up to 200, take bits of the coordinates": {
        "TexNoise[noise_dimensions 2D, noise_type FBM, normalize False].Color": (0.036, 0),
        "TexNoise[noise_dimensions 2D, noise_type MULTIFRACTAL, normalize False].Color": (0.023, 0),
        "TexNoise[noise_dimensions 2D, noise_type MULTIFRACTAL, normalize True].Color": (0.023, 0),
        "TexNoise[noise_dimensions 3D, noise_type FBM, normalize False].Color": (0.019, 0),
        "TexNoise[noise_dimensions 4D, noise_type FBM, normalize False].Color": (0.019, 0),
        "TexNoise[noise_dimensions 4D, noise_type FBM, normalize False].Fac": (0.018, 0),
        "TexNoise[noise_dimensions 4D, noise_type HETERO_TERRAIN, normalize False].Color": (0.017, 0),
        "TexNoise[noise_dimensions 4D, noise_type HETERO_TERRAIN, normalize True].Color": (0.017, 0),
        "TexNoise[noise_dimensions 4D, noise_type MULTIFRACTAL, normalize False].Color": (0.018, 0),
        "TexNoise[noise_dimensions 4D, noise_type MULTIFRACTAL, normalize True].Color": (0.018, 0),
    },
    "rounding, of single precision in the fit and the tables of the sky": {
        "TexSky[NISHITA].": (0.023, 0.11),
        "TexSky[PREETHAM].": (0.024, 0.11),
    },
    "Cycles counts from the near clipping plane, Lambent from the camera": {
        "LightPath[Ray Length].": (0.26, 0.2),
    },
    "under uneven scale the normal that Cycles takes back to object space is not of unit length": {
        "NormalMap[as a value].": (0.42, 0.17),
    },
    "of images that Blender holds Cycles multiplies the bytes by alpha and rounds them down": {
        "TexImage[pattern.Color].": (0.66, 0.23),
    },
    "Cycles 4.2 to 4.5 goes on with 0 beyond the ends of a profile's angles, since it misses that they are a whole turn by a bit": {
        "TexIES[INTERNAL].": (0.31, 0.16),
    },
    "Cycles counts refraction at facets that face away, and blurs what index 1 does": {
        "BsdfGlass[BECKMANN roughness 1.0].": (0.73, 0.72),
        "BsdfGlass[GGX roughness 0.5].": (6.1, 2.5),
        "BsdfGlass[GGX roughness 1.0].": (72, 8.8),
        "BsdfGlass[MULTI_GGX roughness 0.5].": (5.3, 0.69),
        "BsdfGlass[MULTI_GGX roughness 1.0].": (67, 2.1),
        "BsdfGlass[index 0.8].": (0.3, 0.69),
        "BsdfGlass[index 1].": (3.4, 1.4),
        "BsdfRefraction[BECKMANN roughness 1.0].": (2.9, 0.83),
        "BsdfRefraction[GGX roughness 0.2].": (0.37, 0.2),
        "BsdfRefraction[GGX roughness 0.5].": (16, 3.5),
        "BsdfRefraction[GGX roughness 1.0].": (73, 8.3),
        "BsdfRefraction[index 0.8].": (2.6, 0.99),
        "BsdfRefraction[index 1].": (3.3, 1.4),
        "BsdfRefraction[index 2.4].": (2.6, 0.51),
    },
    (
        "where a sampled half vector lies behind the view Cycles turns it, but not its cosine, so that it reflects "
        "where its density does not say: too much at grazing angles (roughness 1 at 70 degrees: 0.37 of the light for "
        "0.30)"
    ): {
        "BsdfAnisotropic[ASHIKHMIN_SHIRLEY anisotropy 0.7 rotation 0.0].": (1.1, 0.38),
        "BsdfAnisotropic[ASHIKHMIN_SHIRLEY anisotropy 0.7 rotation 0.2].": (0.19, 0.17),
    },
    "conductors given by index and extinction are fitted by F82": {
        "BsdfMetallic[PHYSICAL_CONDUCTOR BECKMANN].": (0.61, 0.11),
    },
    "fits of the tables that Cycles has (Zeltner et al. 2022)": {
        "BsdfSheen[MICROFIBER roughness 0.1].": (0.018, 0.11),
        "BsdfSheen[MICROFIBER roughness 0.4].": (1.1, 0.17),
        "BsdfSheen[MICROFIBER roughness 0.8].": (2.4, 0.15),
    },
    "on a surface Cycles lets light in from below it": {
        "BsdfHair[Reflection roughness 0.1].": (30, 14),
        "BsdfHair[Reflection roughness 0.5].": (38, 15),
        "BsdfHair[Transmission roughness 0.1].": (49, 13),
        "BsdfHair[Transmission roughness 0.5].": (49, 15),
    },
    (
        "Cycles samples the coat's reflection as wide as without a coat, but counts with its density: a clear hair in "
        "white light shows 1.015"
    ): {
        "BsdfHairPrincipled[ABSORPTION coat].": (4.8, 1.9),
        "BsdfHairPrincipled[COLOR coat].": (5.4, 1.8),
        "BsdfHairPrincipled[MELANIN coat].": (4.7, 1.7),
    },
    "few of the samples hold much of the light: with four times as many they agree": {
        "BsdfPrincipled[half metal (MULTI_GGX)].": (1.1, 0.3),
        "BsdfPrincipled[rough metal (MULTI_GGX)].": (1.1, 0.41),
        "BsdfPrincipled[subsurface (MULTI_GGX)].": (5.7, 1.2),
        "SubsurfaceScattering[RANDOM_WALK].": (11, 0.78),
    },
    "not explained; Cycles from 4.0 on keeps the axis across the view as the lobe's normal": {
        "BsdfHairPrincipled[ABSORPTION rough].": (9.2, 1.2),
        "BsdfHairPrincipled[MELANIN rough].": (4.4, 0.61),
    },
}  # fmt: skip

# 5.2.2
k_blender_5 = {
    "Cycles leaves this node out, as if what it leads to had no link; Lambent names it and takes grey": {
        "Squeeze[].Value": (65, 0),
    },
    "rounding, of single precision in the fit and the tables of the sky": {
        "TexSky[MULTIPLE_SCATTERING].": (0.036, 0.11),
        "TexSky[PREETHAM].": (0.024, 0.11),
        "TexSky[SINGLE_SCATTERING].": (0.026, 0.11),
    },
    "Cycles counts from the near clipping plane, Lambent from the camera": {
        "LightPath[Ray Length].": (0.26, 0.2),
    },
    "under uneven scale the normal that Cycles takes back to object space is not of unit length": {
        "NormalMap[as a value].": (0.37, 0.2),
    },
    "of images that Blender holds Cycles multiplies the bytes by alpha and rounds them down": {
        "TexImage[pattern.Color].": (0.7, 0.24),
    },
    "Cycles 5 multiplies floats that Blender generated by their alpha, once more": {
        "TexImage[float pattern.Color].": (110, 23),
    },
    "Cycles goes on with the last value beyond the ends of a profile's angles, since it misses that they are a whole turn by a bit": {
        "TexIES[INTERNAL].": (0.12, 0.11),
    },
    "Cycles counts refraction at facets that face away, and blurs what index 1 does": {
        "BsdfGlass[BECKMANN roughness 1.0].": (2.7, 0.71),
        "BsdfGlass[GGX roughness 0.5].": (6.1, 2.5),
        "BsdfGlass[GGX roughness 1.0].": (74, 9.1),
        "BsdfGlass[MULTI_GGX roughness 0.5].": (5.3, 0.65),
        "BsdfGlass[MULTI_GGX roughness 1.0].": (69, 2.3),
        "BsdfGlass[index 0.8].": (0.3, 0.66),
        "BsdfGlass[index 1].": (3.5, 1.4),
        "BsdfRefraction[BECKMANN roughness 1.0].": (3, 0.86),
        "BsdfRefraction[GGX roughness 0.2].": (0.4, 0.22),
        "BsdfRefraction[GGX roughness 0.5].": (16, 3.5),
        "BsdfRefraction[GGX roughness 1.0].": (76, 8.7),
        "BsdfRefraction[index 0.8].": (2.7, 0.96),
        "BsdfRefraction[index 1].": (3.4, 1.4),
        "BsdfRefraction[index 2.4].": (2.6, 0.63),
    },
    (
        "where a sampled half vector lies behind the view Cycles turns it, but not its cosine, so that it reflects "
        "where its density does not say: too much at grazing angles (roughness 1 at 70 degrees: 0.37 of the light for "
        "0.30)"
    ): {
        "BsdfAnisotropic[ASHIKHMIN_SHIRLEY anisotropy 0.7 rotation 0.0].": (1.1, 0.36),
        "BsdfAnisotropic[ASHIKHMIN_SHIRLEY anisotropy 0.7 rotation 0.2].": (0.19, 0.12),
    },
    "conductors given by index and extinction are fitted by F82": {
        "BsdfMetallic[PHYSICAL_CONDUCTOR BECKMANN].": (0.77, 0.4),
        "BsdfMetallic[PHYSICAL_CONDUCTOR MULTI_GGX].": (0.96, 0.56),
    },
    "fits of the tables that Cycles has (Zeltner et al. 2022)": {
        "BsdfSheen[MICROFIBER roughness 0.1].": (0.018, 0.11),
        "BsdfSheen[MICROFIBER roughness 0.4].": (1.1, 0.18),
        "BsdfSheen[MICROFIBER roughness 0.8].": (2.3, 0.18),
    },
    "on a surface Cycles lets light in from below it": {
        "BsdfHair[Reflection roughness 0.1].": (33, 14),
        "BsdfHair[Reflection roughness 0.5].": (36, 15),
        "BsdfHair[Transmission roughness 0.1].": (46, 12),
        "BsdfHair[Transmission roughness 0.5].": (52, 15),
    },
    (
        "Cycles from 4.5 on takes a hair's axis across the view for a bumped normal where it is on a surface, and drops"
        " half the directions of lights it samples; they agree under a sky that it does not (--sky-alone)"
    ): {
        "BsdfHairPrincipled[ABSORPTION Huang].": (6.8, 2.3),
        "BsdfHairPrincipled[ABSORPTION coat].": (11, 2.8),
        "BsdfHairPrincipled[ABSORPTION pale].": (12, 2.9),
        "BsdfHairPrincipled[ABSORPTION rough].": (59, 9.3),
        "BsdfHairPrincipled[ABSORPTION tilted].": (12, 1.3),
        "BsdfHairPrincipled[ABSORPTION].": (5.7, 1.1),
        "BsdfHairPrincipled[COLOR Huang].": (10, 1.9),
        "BsdfHairPrincipled[COLOR coat].": (11, 2.5),
        "BsdfHairPrincipled[COLOR pale].": (15, 3.7),
        "BsdfHairPrincipled[COLOR rough].": (16, 2.8),
        "BsdfHairPrincipled[COLOR tilted].": (6.3, 0.86),
        "BsdfHairPrincipled[COLOR].": (7.1, 1.4),
        "BsdfHairPrincipled[MELANIN Huang].": (7.8, 1.5),
        "BsdfHairPrincipled[MELANIN coat].": (6.7, 2),
        "BsdfHairPrincipled[MELANIN pale].": (8, 1.6),
        "BsdfHairPrincipled[MELANIN rough].": (36, 4.4),
        "BsdfHairPrincipled[MELANIN tilted].": (4.2, 0.47),
        "BsdfHairPrincipled[MELANIN].": (4.4, 0.44),
    },
    "few of the samples hold much of the light: with four times as many they agree": {
        "BsdfPrincipled[thin film (MULTI_GGX)].": (1.2, 0.31),
        "BsdfToon[GLOSSY size 0.5 smooth 0.0].": (1.5, 0.36),
    },
    "not explained: 0.1 to 0.3 percent darker, where spheres cast shadows": {
        "NormalMap[BLENDER_WORLD strength 1.0].": (0.44, 0.49),
        "NormalMap[TANGENT strength 1.0].": (0.86, 0.37),
    },
}  # fmt: skip

k_measured = {3: k_blender_3, 4: k_blender_4, 5: k_blender_5}


def reason(verdict, blender, bounded=True):
    """Why a case may differ as much as it does in that version of Blender ("3.4.1"), or "". @param bounded: else by any amount"""
    from compare import label

    major = min(max(int(blender.split(".")[0]), min(k_measured)), max(k_measured))
    for why, cases in k_measured[major].items():
        largest, mean = cases.get(label(verdict.case), (-1.0, -1.0))
        if 100.0 * verdict.sure <= largest and 100.0 * verdict.mean_sure <= mean or not bounded and largest >= 0.0:
            return why
    return ""
