"""Differences of passes that are known: why, and how large each may be. A pass that differs otherwise, or by more, fails.

`tiles` bounds the share of tests (tiles times channels) that differ by over 1%, `mean` by how much the picture's mean differs, what four
standard errors explain left out; both in percent, a third more than measured with 120 to 240 pixels across (small pictures have more
of their tiles at edges). Between integrators passes are named as compare_passes has them: quotients times what they were divided by.
"""

from typing import NamedTuple


class Known(NamedTuple):
    why: str
    tiles: float
    mean: float


def _all(why, bounds):
    """{pass: Known} from {pass: (tiles, mean)}."""
    return {name: Known(why, *bound) for name, bound in bounds.items()}


# --- PT against Cycles -----------------------------------------------------------------------------------------------------------

k_any_cycles = {
    **_all("of the middle of the pixel; Cycles takes the first sample, wherever it fell", {"Depth": (8, 0.5)}),
    **_all(
        "of the middle of the pixel, found behind half-transparent surfaces too; Cycles takes the first sample, which may have been scattered before",
        {"Position": (15, 7), "Material Index": (15, 3), "Object Index": (15, 3)}),
    **_all(
        "behind half-transparent surfaces weighted by what is seen; Cycles counts every sample that got there alike",
        {"Normal": (20, 3), "UV": (21, 4)}),
    **_all("weighted by opacity; Cycles adds the AOVs of half-transparent surfaces in full", {"tint": (21, 4), "amount": (30, 38)}),
}  # fmt: skip
k_left_to_chance = (
    "Cycles counts what lies behind glass and half-transparent surfaces by its share and once more by how often a sample goes there, and "
    "light by the colours before it twice"
)
k_an_eighth = k_left_to_chance + "; each lobe of what the camera sees gets an eighth of the samples at least (glass: 0.92 of its albedo)"
# Normals have both signs: their mean says little of them.
k_signed = float("inf")
k_cycles_3 = {
    **k_any_cycles,
    **_all(k_an_eighth, {"Denoising Albedo": (27, 6), "Denoising Normal": (19, k_signed), "Denoising Depth": (4, 0.3)}),
    **_all(
        "Cycles before 4.0 gives weights without the Fresnel term, and what is divided by them accordingly",
        {"Glossy Color": (20, 95), "Glossy Direct": (15, 56), "Glossy Indirect": (15, 67)}),
    **_all("light received over that without shadows, by its strength; Cycles counts samples of lights alike", {"Shadow": (95, 29)}),
    **_all(
        "Cycles 3 samples GGX normals for clearcoats but counts with the density of GTR1 ones: what they sample, the diffuse part "
        "included, comes out up to 4% dark",
        {"Combined": (5, 0.3), "Diffuse Direct": (5, 0.5)}),
    "Combined_sky": Known("as Combined", 10, 0.5),
    "Combined_keys": Known("as Combined", 1, 0.3),  # tile (144, 48) of the clearcoat, 240 px wide
}  # fmt: skip
k_cycles_4 = {
    **k_any_cycles,
    **_all(
        k_an_eighth + "; of coats the albedo is estimated otherwise",
        {"Denoising Albedo": (44, 7), "Denoising Normal": (19, k_signed), "Denoising Depth": (8, 0.3)}),
    **_all(
        "of coats and rough glass the albedo is estimated otherwise; what is divided by it accordingly",
        {"Glossy Color": (58, 8), "Transmission Color": (4, 1.6)}),
    # At 240 px: times Glossy Color 1.002 +- 0.002, and no test differs by over 1%.
    "Glossy Direct": Known("what it is divided by, Glossy Color, is 1.03 of Cycles'", 2, 1),
    "Transmission Direct": Known("nothing; Cycles 4.3 and 5.2 have up to 1e-4 at the facets of the glass ball's silhouette", 6, 100),
}  # fmt: skip
k_cycles_5 = {
    **k_cycles_4,
    **_all(
        k_left_to_chance + "; of coats the albedo is estimated otherwise",
        {"Denoising Albedo": (26, 1), "Denoising Normal": (18, k_signed), "Denoising Depth": (4, 0.3)}),
    **_all(
        "behind half-transparent surfaces Cycles 5.2 weights by their transparency and goes on by chance, so that it counts twice",
        {"Denoising Specular Albedo": (14, 2), "Denoising Roughness": (20, 2)}),
}


def of_cycles(version):
    """{pass: Known} of PT against Cycles in a Blender of a version such as "3.4.1"."""
    return {"3": k_cycles_3, "4": k_cycles_4}.get(version.partition(".")[0], k_cycles_5)


# --- Integrators against PT ------------------------------------------------------------------------------------------------------

k_groups = ("keys", "rim", "signs", "sky")
k_rare = (
    "few light paths bring it and they are bright (over rough glass or gloss of alpha 0.04, on which light arrives by chance): most batches "
    "have hardly any and look alike, so that the test takes them for sure. In the 120 px wide picture LT's Combined_rim is 0.70 of PT's with 256 "
    "samples and 0.96 with 3,072, in tile (96, 32) 0.24 and 0.66"
)
k_shared = (
    "what narrow gloss and rough glass (alpha 0.04) throw on other surfaces comes by connections to their vertices on light walks that all "
    "pixels share, which have to lie in the lobes: rare and bright spots, and batches that have none look alike. In the 120 px wide picture, "
    "under the glass ball, Combined is 0.80 to 0.87 of PT's with 256 as with 1,024 samples; what is seen in gloss and through glass is found by camera walks"
)
k_by_bpt = "of two noisy pictures, the one without shadows made by BPT's techniques"
k_few_received = (
    "what a surface receives was asked for in every eighth sample (every fourth now), and a quotient of few samples lies lower: 0 where none of them met it. 60 px wide "
    "PPM's mean is 0.972 +- 0.002 of PT's with 32 samples; with 256 it is 0.996 +- 0.002 of PT's with 32, and no test differs by over 1%"
)
k_blur = (
    "photons are gathered over edges: at the 120 px wide picture's leaf 0.933 +- 0.006 of PT's, with a quarter of the radius 0.989 +- 0.016; "
    "inside of surfaces nothing differs (floor: 0.999 +- 0.002)"
)
k_blur_behind_glass = (
    "photons are gathered across the bright edges under the glass ball, seen through it: in tile (112, 16) of the 120 px wide picture "
    "Combined_keys is 0.0444 with a radius of 2 px and 0.0371 with 0.5 px; PT and BPT have 0.0367 and 0.0363 in 8,192 samples"
)
k_rare_in_pt = {
    **_all(
        "PT undersamples it: in tile (80, 0) it is 1.6e-5 in 8 batches of 64 samples and 5.1e-5 in 8,192 samples, where BPT, BPM and VCM "
        "have 4.2e-5 to 4.5e-5 at once",
        {"Caustics Indirect": (2, 5)}),
    "Shadow Difference_keys": Known(
        "PT undersamples it: in tile (176, 48) it is 1.5e-4 +- 0.3e-4 in 512 samples and 2.5e-4 +- 0.2e-4 in 12,288, where BPT has 2.5e-4 "
        "and 2.8e-4",
        0.3, 0,
    ),
    "Shadow Ratio_signs x Without Shadow_signs": Known(
        "a quotient by 0 is 0, and so is the product: with 64 samples PT's has 0.7 of its own Combined_signs in tile (128, 32), which "
        "itself agrees; splats leave fewer pixels without",
        3, 0.5,
    ),
}  # fmt: skip
# Where splats reach a pixel in which no sample met any of a colour, that reads 1/1024 in place of 0, so that products give back the sums.
k_splats = _all(
    "where splats reach a pixel in which no sample met the colour, that reads 1/1024 and not 0",
    {"Diffuse Color": (1, 0.05), "Glossy Color": (1, 0.05), "Transmission Color": (1, 0.05)})  # fmt: skip


def _shadows(tiles, **ratios):
    """{pass: Known} of the passes of shadows: differences, of which quotients mean nothing, and products of ratios, by light group or ""."""
    differences = {"Shadow Difference": tiles} | {f"Shadow Difference_{group}": tiles for group in k_groups}
    products = {f"Shadow Ratio{end} x Without Shadow{end}": bound for end, bound in ((f"_{group}" if group else "", bound) for group, bound in ratios.items())}
    return {**_all(k_by_bpt, {name: (tiles, float("inf")) for name, tiles in differences.items()}), **_all(k_rare, products)}


k_integrators = {
    "LT": {
        **k_rare_in_pt, **k_splats,
        **_all(k_rare, {"Caustics Indirect": (2, 1), "Combined": (4, 1), "Combined_keys": (2.5, 1), "Combined_rim": (6, 29), "Combined_signs": (8, 1), "Combined_sky": (2.5, 1)}),
        **_all(k_rare, {"Glossy Indirect x Glossy Color": (7, 1), "Transmission Indirect x Transmission Color": (9, 1)}),
        **_all(
            "light paths that gloss of alpha 0.04 sends to the lens are few and bright: in the 120 px wide picture's tile (96, 24) it is 0.67 of PT's "
            "with 300 samples and 0.89 with 2,500, over the whole picture 0.990",
            {"Glossy Direct x Glossy Color": (2, 1)}),
        **_all(k_few_received, {"Shadow": (17, 1.5)}),
        **_shadows(7, **{"": (5, 1)}, keys=(2.5, 1), rim=(6, 30), signs=(7, 1), sky=(2.5, 1)),
    },
    "VPL": {
        **k_rare_in_pt,
        **_all(k_shared, {"Caustics Direct": (6, 1), "Caustics Indirect": (3.5, 1), "Combined": (4, 1)}),
        **_all(k_shared, {"Combined_rim": (4, 1), "Combined_signs": (3, 1), "Combined_sky": (12, 1)}),
        **_all(k_shared, {"Diffuse Indirect x Diffuse Color": (7, 1), "Glossy Indirect x Glossy Color": (4, 1)}),
        **_all(k_few_received, {"Shadow": (17, 1.5)}),
        **_shadows(12, **{"": (5.5, 1)}, rim=(8, 1), signs=(3.5, 0.5), sky=(12, 1)),
    },
    "PPM": {
        **k_rare_in_pt,
        **_all(k_blur, {"Combined": (2, 0.5)}),
        **_all(k_rare, {"Combined_signs": (2.5, 1)}),
        **_all(k_few_received, {"Shadow": (20, 1.5)}),
        **_shadows(2.5, rim=(4, 1), signs=(3, 0.5)),
    },
    "BPM": {
        **k_rare_in_pt,
        **_all(k_rare, {"Combined_keys": (0.5, 1), "Combined_signs": (6.7, 1), "Diffuse Indirect x Diffuse Color": (0.5, 1), "Glossy Direct x Glossy Color": (3.5, 1)}),
        **_all(k_blur, {"Combined": (1, 1)}),
        **_all(k_few_received, {"Shadow": (17, 1.5)}),
        **_shadows(8, **{"": (1.5, 1)}, rim=(4.5, 1), signs=(5, 1)),
    },
    "BPT": {**k_rare_in_pt, **k_splats},
    "VCM": {
        **k_rare_in_pt, **k_splats,
        **_all(k_blur_behind_glass, {"Combined": (2, 0.3), "Combined_keys": (2.5, 0.4), "Transmission Indirect x Transmission Color": (3.5, 2)}),
        **_shadows(2.5, **{"": (2.5, 0.3)}, keys=(2.5, 0.4), signs=(3, 0.5)),
    },
}  # fmt: skip


def of_integrator(name):
    """{pass: Known} of an integrator against PT."""
    return k_integrators.get(name, k_rare_in_pt)
