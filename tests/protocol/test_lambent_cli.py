"""`lambent` from outside: renders, interruption, full disks, wrong usage, comparison."""

import os
import pathlib
import re
import resource
import signal
import subprocess
import time

import OpenImageIO as oiio
import pytest
from daemon_programs import BIN, Daemon
from test_lambentd import never, prepare

LAMBENT = BIN / "lambent"


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A saved scene of 160 x 96 pixels and 4 samples, written by the daemon."""
    if not LAMBENT.exists():
        pytest.skip(f"{LAMBENT} is not built")
    folder = tmp_path_factory.mktemp("s")
    daemon = Daemon("lambentd", folder)
    client = daemon.client()
    prepare(client, 1)
    path = folder / "scene.lambent"
    client.ask({"type": "save_scene", "path": str(path)}, "scene_saved", never)
    client.close()
    assert daemon.stop() == 0
    return path


def lambent(*arguments, **options):
    return subprocess.run([str(LAMBENT), *map(str, arguments)], capture_output=True, text=True, timeout=120, **options)


def test_renders_the_same_picture_with_any_number_of_threads(scene, tmp_path):
    one = lambent("render", scene, "-o", tmp_path / "one.exr", "--threads", 1)
    two = lambent("render", scene, "-o", tmp_path / "two.exr", "--threads", 2, "--quiet")
    assert one.returncode == 0 and two.returncode == 0, one.stderr + two.stderr
    assert f"Saved: '{tmp_path / 'one.exr'}'" in one.stderr and two.stderr == ""
    same = lambent("diff", tmp_path / "one.exr", tmp_path / "two.exr")
    assert same.returncode == 0 and "relMSE      0\n" in same.stdout
    assert sorted(os.listdir(tmp_path)) == ["one.exr", "two.exr"]


def test_another_seed_is_another_noise_of_the_same_mean(scene, tmp_path):
    for name, seed in (("a", 1), ("b", 2)):
        assert lambent("render", scene, "-o", tmp_path / f"{name}.exr", "--seed", seed, "--samples", 16).returncode == 0
    different = lambent("diff", tmp_path / "a.exr", tmp_path / "b.exr", "--failing-tiles", 0)
    assert different.returncode == 1 and "tiles       0 of 60 differ" in different.stdout, different.stdout
    assert lambent("diff", tmp_path / "a.exr", tmp_path / "b.exr", "--threshold", 100, "--failing-tiles", 0).returncode == 0


def entry(picture, name):
    """An entry of a picture's metadata, as text."""
    return lambent("info", picture).stdout.split(f"lambent/{name}: ")[1].split()[0]


def test_a_time_limit_ends_a_render_without_end(scene, tmp_path):
    picture = tmp_path / "a.exr"
    done = lambent("render", scene, "-o", picture, "--samples", 0, "--time-limit", 1.5)
    assert done.returncode == 0, done.stderr
    assert entry(picture, "status") == "finished" and int(entry(picture, "samples")) > 0
    # It is looked at between tiles, which on a busy machine wait their turn.
    assert 1.5 <= float(entry(picture, "render_time_s")) < 10


def test_samples_end_a_render_before_its_time_limit(scene, tmp_path):
    picture = tmp_path / "a.exr"
    assert lambent("render", scene, "-o", picture, "--samples", 3, "--time-limit", 1000).returncode == 0
    assert entry(picture, "samples") == "3" and float(entry(picture, "render_time_s")) < 100


@pytest.mark.parametrize("integrator", ["BPT", "VCM"])
def test_an_integrator_of_choice_renders_the_same_light_by_its_own_way(scene, tmp_path, integrator):
    # Of seeds of their own: direct light is found by the same numbers in both, and would be the same but for rounding.
    for name, chosen, seed in (("a", "PT", 1), ("b", integrator, 2)):
        done = lambent("render", scene, "-o", tmp_path / f"{name}.exr", "--integrator", chosen, "--samples", 64, "--seed", seed)
        assert done.returncode == 0, done.stderr
        assert entry(tmp_path / f"{name}.exr", "integrator") == chosen
    compared = lambent("diff", tmp_path / "a.exr", tmp_path / "b.exr", "--failing-tiles", 0)
    assert "relMSE      0\n" not in compared.stdout and "tiles       0 of 60 differ" in compared.stdout, compared.stdout


def pixels_of(path):
    """{channel name: float32[height][width]} of a picture file."""
    picture = oiio.ImageInput.open(str(path))
    values, names = picture.read_image(oiio.FLOAT), picture.spec().channelnames
    picture.close()
    return {name: values[..., i] for i, name in enumerate(names)}


@pytest.mark.parametrize("integrator", ["LT", "VPL", "BPT", "PPM", "BPM", "VCM"])
def test_techniques_are_pictures_that_add_up(scene, tmp_path, integrator):
    folder = tmp_path / "techniques"
    done = lambent("render", scene, "-o", tmp_path / "a.exr", "--integrator", integrator, "--techniques", folder)
    assert done.returncode == 0, done.stderr
    assert sorted(os.listdir(folder)) == ["shares.exr", "shares.png", "techniques.exr", "unweighted.png", "weighted.png"]
    whole, parts = pixels_of(tmp_path / "a.exr"), pixels_of(folder / "techniques.exr")
    summed = sum(values for name, values in parts.items() if name.startswith("weighted_") and name.endswith(".R"))
    # Samples weigh by a filter as wide as several pixels, so light arrives beside the pixel that it is noted for: the sums are the same.
    assert summed.sum() == pytest.approx(whole["R"].sum(), rel=0.02)
    lengths = {name.split("_", 1)[1] for name in parts if name.startswith("unweighted_")}
    if integrator in ("BPT", "VCM"):
        # Direct light on what the camera sees is left to next events and emission hits.
        assert "s1_t2.R" in lengths and "s2_t1.R" not in lengths
    shares = pixels_of(folder / "shares.exr")
    total = shares["R"] + shares["G"] + shares["B"]
    assert ((abs(total - 1) < 1e-3) | (total == 0)).all() and (total > 0).mean() > 0.5
    for name in ("weighted.png", "unweighted.png", "shares.png"):
        assert sum(values.astype(float).sum() for values in pixels_of(folder / name).values()) > 0


def test_memory_does_not_grow_with_passes(scene, tmp_path):
    peaks = []
    for samples in (4, 100):
        done = lambent("render", scene, "-o", tmp_path / "a.exr", "--integrator", "BPM", "--samples", samples, "--threads", 1)
        assert done.returncode == 0, done.stderr
        peaks.append(float(re.search(r"peak memory ([\d.]+)M", done.stderr)[1]))
    assert peaks[1] < peaks[0] + 2.0, peaks  # a pass leaves 1.2 MiB of photons and records


def test_info_names_what_a_picture_and_a_scene_hold(scene, tmp_path):
    picture = tmp_path / "a.exr"
    assert lambent("render", scene, "-o", picture, "--samples", 2, "--seed", 9, "--region", 10, 20, 60, 50).returncode == 0
    about = lambent("info", picture).stdout
    for text in ("R G B A", "lambent/samples: 2", "lambent/seed: 9", "lambent/integrator: PT", "lambent/camera: Camera", str(scene)):
        assert text in about, about
    assert "data window   50 x 30 px at (10, 46)" in about
    about = lambent("info", scene).stdout
    for text in ("meshes        1 (2 triangles)", "objects       2", "lights        1", "160 x 96 px", "samples       4", "BsdfDiffuse"):
        assert text in about, about


def test_resolution_and_png(scene, tmp_path):
    assert lambent("render", scene, "-o", tmp_path / "a.png", "--resolution", 40, 20, "--samples", 1).returncode == 0
    about = lambent("info", tmp_path / "a.png").stdout
    assert "(png)" in about and "40 x 20 px" in about


def test_an_interrupt_saves_what_is_done_and_a_checkpoint_continues_it(scene, tmp_path):
    picture, checkpoint = tmp_path / "a.exr", tmp_path / "a.checkpoint"
    process = subprocess.Popen(
        [LAMBENT, "render", scene, "-o", picture, "--samples", "0", "--checkpoint", checkpoint], stderr=subprocess.PIPE, text=True
    )
    while "Sample" not in process.stderr.readline():  # a line every few seconds where there is no terminal
        pass
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130 and "interrupted" in errors, errors
    done = int(lambent("info", picture).stdout.split("lambent/samples: ")[1].split()[0])
    assert done > 0
    target = 4 * done  # more than any tile has: some were ahead when the interrupt came
    resumed = lambent("render", scene, "-o", tmp_path / "b.exr", "--samples", target, "--checkpoint", checkpoint, "--resume")
    assert resumed.returncode == 0, resumed.stderr
    assert lambent("render", scene, "-o", tmp_path / "c.exr", "--samples", target).returncode == 0
    assert "relMSE      0\n" in lambent("diff", tmp_path / "b.exr", tmp_path / "c.exr").stdout


def test_a_place_that_cannot_be_written_keeps_the_picture_elsewhere(scene, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    failed = lambent("render", scene, "-o", tmp_path / "no" / "a.exr", "--fallback-dir", elsewhere)
    assert failed.returncode == 1 and str(tmp_path / "no" / "a.exr") in failed.stderr
    (kept,) = elsewhere.iterdir()
    assert str(kept) in failed.stderr and "R G B A" in lambent("info", kept).stdout


def test_a_full_disk_is_an_error_and_leaves_no_half_picture(scene, tmp_path):
    picture = tmp_path / "a.exr"
    picture.write_text("old")

    def fill():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))

    failed = lambent(
        "render", scene, "-o", picture, "--fallback-dir", tmp_path, preexec_fn=fill, restore_signals=False
    )
    assert failed.returncode == 1 and str(picture) in failed.stderr and "File too large" in failed.stderr
    assert os.listdir(tmp_path) == ["a.exr"] and picture.read_text() == "old"


def on_a_small_disk(disk, *command):
    """Runs a command while a file system of 32 KB is mounted at the folder `disk`, for the command alone; lists on stdout what
    is on it at the end. Skips where this process may not mount."""
    # In a chroot the root is no mount whose propagation could be changed.
    mounts = [line.split()[4] for line in pathlib.Path("/proc/self/mountinfo").read_text(encoding="ascii").splitlines()]
    unshare = ["unshare", "--mount", *([] if "/" in mounts else ["--propagation", "unchanged"])]
    small = [*unshare, "sh", "-c", 'mount -t tmpfs -o size=32k none "$0" || exit 99; "$@"; code=$?; ls -A "$0"; exit $code']
    ran = subprocess.run([*small, str(disk), *map(str, command)], capture_output=True, text=True, timeout=120)
    if ran.returncode == 99 or "unshare failed" in ran.stderr:
        pytest.skip("a file system can be mounted by root only")
    return ran


def test_a_really_full_disk_at_the_end_of_a_render_keeps_the_picture_elsewhere(scene, tmp_path):
    disk, elsewhere = tmp_path / "disk", tmp_path / "elsewhere"
    disk.mkdir()
    elsewhere.mkdir()
    picture = disk / "a.exr"
    failed = on_a_small_disk(disk, LAMBENT, "render", scene, "-o", picture, "--fallback-dir", elsewhere)
    assert failed.returncode == 1 and str(picture) in failed.stderr and "No space left on device" in failed.stderr, failed.stderr
    assert failed.stdout == "", "nothing half-written stays on the disk"
    (kept,) = elsewhere.iterdir()
    assert str(kept) in failed.stderr and "R G B A" in lambent("info", kept).stdout


def test_a_really_full_disk_is_named_for_a_checkpoint_too(scene, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    checkpoint, picture = disk / "a.checkpoint", tmp_path / "a.exr"
    failed = on_a_small_disk(disk, LAMBENT, "render", scene, "-o", picture, "--checkpoint", checkpoint)
    assert failed.returncode == 1 and str(checkpoint) in failed.stderr and "No space left" in failed.stderr, failed.stderr
    assert failed.stdout == "" and "R G B A" in lambent("info", picture).stdout


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["render", "SCENE", "-o", "a.tga"], 2, "a.tga"),
        (["render", "SCENE"], 2, "--output"),
        (["render", "missing.lambent", "-o", "a.exr"], 1, "missing.lambent"),
        (["render", "SCENE", "-o", "a.exr", "--camera", "Nobody"], 2, "'Camera'"),
        (["render", "SCENE", "-o", "a.exr", "--integrator", "XYZ"], 2, "XYZ"),
        (["render", "SCENE", "-o", "a.exr", "--region", "5", "5", "5", "9"], 2, "--region"),
        (["render", "SCENE", "-o", "a.exr", "--samples", "-1"], 2, "--samples"),
        (["render", "SCENE", "-o", "a.exr", "--resume"], 2, "--checkpoint"),
        (["render", "SCENE", "-o", "a.exr", "--checkpoint", "missing", "--resume"], 1, "missing"),
        (["info", "missing.exr"], 1, "missing.exr"),
        (["diff", "missing.exr", "missing.exr"], 2, "missing.exr"),
    ],
)
def test_wrong_usage_is_explained(scene, tmp_path, arguments, code, text):
    failed = lambent(*[scene if one == "SCENE" else one for one in arguments], cwd=tmp_path)
    assert failed.returncode == code and text in failed.stderr, failed.stderr
    assert os.listdir(tmp_path) == []


def test_a_damaged_scene_is_named(scene, tmp_path):
    damaged = pathlib.Path(tmp_path, "damaged.lambent")
    data = bytearray(scene.read_bytes())
    for length in (0, 10, 100, len(data) - 1):
        damaged.write_bytes(data[:length])
        failed = lambent("render", damaged, "-o", tmp_path / "a.exr")
        assert failed.returncode == 1 and str(damaged) in failed.stderr
