"""`lambent measure` and `lambent sheet` from outside: what they write, what they keep, wrong usage."""

import csv
import math
import os

import pytest
from test_lambent_cli import lambent, scene  # noqa: F401  (the fixture)


def rows_of(path):
    with open(path, encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_curves_fall_and_the_reference_is_rendered_once(scene, tmp_path):
    reference, out = tmp_path / "reference.exr", tmp_path / "out"
    arguments = ["measure", scene, "-o", out, "--reference", reference, "--integrators", "PT", "--resolution", 32, 20]
    first = lambent(*arguments, "--reference-time", 1, "--samples", "1,16", "--seeds", 2, "--pictures")
    assert first.returncode == 0, first.stderr
    assert "rendering the reference with PT" in first.stderr
    assert sorted(os.listdir(out)) == ["PT_16spp.exr", "PT_1spp.exr", "curves.csv", "curves.png", "speed_ups.csv"]
    rows = rows_of(out / "curves.csv")
    assert [(row["integrator"], row["sample_limit"], row["samples"]) for row in rows] == [("PT", "1", "1")] * 2 + [("PT", "16", "16")] * 2
    assert rows[0]["seed"] != rows[1]["seed"] and rows[0]["rel_mse"] != rows[1]["rel_mse"]
    errors = [float(row["rel_mse"]) for row in rows]
    assert sum(errors[2:]) < sum(errors[:2])
    assert all(0 < float(row["smape"]) < 1 and float(row["cpu_s"]) > 0 for row in rows)
    # The kept picture of a point has the error that the curve says.
    compared = lambent("diff", out / "PT_16spp.exr", reference, "--threshold", 1e9).stdout
    assert math.isclose(float(compared.split("relMSE")[1].split()[0]), errors[2], rel_tol=1e-4)
    before = reference.stat().st_mtime_ns
    again = lambent(*arguments, "--reference-time", 1, "--samples", 1, "--quiet")
    assert again.returncode == 0 and again.stderr == "" and reference.stat().st_mtime_ns == before


def test_a_time_limit_is_met_and_other_curves_are_compared(scene, tmp_path):
    reference = tmp_path / "reference.exr"
    assert lambent("render", scene, "-o", reference, "--samples", 64, "--seed", 9, "--quiet").returncode == 0
    other = tmp_path / "other.csv"
    other.write_text(
        "integrator,time_limit_s,sample_limit,seed,samples,render_s,cpu_s,rel_mse,rel_mse_trimmed,smape,non_finite\n"
        "Other,0,1,0,1,0.0001,0.0001,1e-9,1e-9,1e-9,0\nOther,0,4,0,4,100,100,5e-10,5e-10,1e-9,0\n",
        encoding="utf-8",
    )
    arguments = ["measure", scene, "-o", tmp_path / "out", "--reference", reference, "--times", 0.4, "--integrators", "PT"]
    done = lambent(*arguments, "--with", other, "--quiet", "--clock", "render")
    assert done.returncode == 0, done.stderr
    (row,) = rows_of(tmp_path / "out" / "curves.csv")
    assert float(row["render_s"]) >= 0.4 and row["time_limit_s"] == "0.4"
    gains = {row["integrator"]: row for row in rows_of(tmp_path / "out" / "speed_ups.csv")}
    assert float(gains["PT"]["error_ratio"]) == 1 and gains["Other"]["bound"] == "at least "
    assert float(gains["Other"]["error_ratio"]) > 1e3 and "Other" in done.stdout


def test_a_limit_in_processor_time_does_not_count_waiting(scene, tmp_path):
    reference = tmp_path / "reference.exr"
    assert lambent("render", scene, "-o", reference, "--samples", 4, "--quiet").returncode == 0
    arguments = ["measure", scene, "-o", tmp_path / "out", "--reference", reference, "--times", "0.2,0.6", "--integrators", "PT"]
    done = lambent(*arguments, "--quiet")
    assert done.returncode == 0, done.stderr
    times = [float(row["cpu_s"]) for row in rows_of(tmp_path / "out" / "curves.csv")]
    # It is looked at ten times a second, in which two threads may take 0.2 s; what else a render takes is little.
    assert 0.2 <= times[0] < 0.6 <= times[1], times


def test_a_region_is_compared_alone(scene, tmp_path):
    reference = tmp_path / "reference.exr"
    assert lambent("render", scene, "-o", reference, "--samples", 4, "--quiet").returncode == 0
    arguments = ["measure", scene, "--reference", reference, "--samples", 4, "--integrators", "PT", "--quiet"]
    # The same seed and samples: no error, and would be one if another part of the reference were looked at.
    done = lambent(*arguments, "-o", tmp_path / "part", "--region", 10, 20, 60, 50)
    assert done.returncode == 0, done.stderr
    assert float(rows_of(tmp_path / "part" / "curves.csv")[0]["rel_mse"]) == 0


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["--samples", "1"], 2, "--reference"),
        (["--reference", "missing.exr", "--samples", "1"], 2, "missing.exr"),
        (["--reference", "missing.exr"], 2, "--times"),
        (["--reference", "missing.exr", "--times", "-1"], 2, "--times"),
        (["--reference", "missing.exr", "--times", "1", "--integrators", "XYZ"], 2, "XYZ"),
        (["--reference", "small.exr", "--samples", "1"], 1, "small.exr"),
        (["--reference", "small.exr", "--resolution", "8", "8", "--samples", "1", "--with", "missing.csv"], 1, "missing.csv"),
    ],
)
def test_wrong_measurements_are_explained(scene, tmp_path, arguments, code, text):
    small = lambent("render", scene, "-o", "small.exr", "--resolution", 8, 8, "--samples", 1, "--quiet", cwd=tmp_path)
    assert small.returncode == 0, small.stderr
    failed = lambent("measure", scene, "-o", "out", *arguments, cwd=tmp_path)
    assert failed.returncode == code and text in failed.stderr, failed.stderr


def test_a_sheet_has_a_place_for_every_picture(scene, tmp_path):
    picture, sheet = tmp_path / "a.exr", tmp_path / "sheet.png"
    assert lambent("render", scene, "-o", picture, "--samples", 1, "--quiet").returncode == 0
    arguments = ["sheet", picture, "-", "-", picture, "--columns", "PT,Other", "--rows", "one,two", "--width", 80]
    done = lambent(*arguments, "-o", sheet, "--captions", "0.1,-,-,0.2")
    assert done.returncode == 0, done.stderr
    # Two pictures of 80 px and three gaps of 4; a head line of 22 and two rows of 48 + 22 + 4.
    assert "172 x 170 px" in lambent("info", sheet).stdout
    for wrong, text in (
        (["sheet", picture, "--columns", "a,b", "--rows", "c", "-o", sheet], "1 pictures"),
        ([*arguments, "-o", sheet, "--captions", "a"], "1 captions"),
    ):
        failed = lambent(*wrong)
        assert failed.returncode == 2 and text in failed.stderr, failed.stderr
    assert lambent("sheet", "missing.exr", "--columns", "a", "--rows", "b", "-o", sheet).returncode == 1
