"""Starts Blender on a scene and collects pictures, times and memory: what the comparisons with Cycles share.

Blender runs with factory settings and a user folder of its own, in which the source tree's add-on is linked: nothing of
the user's is read or changed.
"""

import dataclasses
import json
import os
import pathlib
import re
import subprocess
import sys
import threading
import time

import numpy
import OpenImageIO as oiio

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "common"))
import multilayer

k_root = pathlib.Path(__file__).resolve().parent.parent.parent
k_render_job = pathlib.Path(__file__).resolve().parent / "render_job.py"
k_third_party = pathlib.Path(os.environ.get("LAMBENT_SHARED_SCENES", k_root.parent / "shared" / "scenes")) / "third_party"


class BlenderFailed(RuntimeError):
    """A run of Blender ended badly; the message holds the end of what it said."""


@dataclasses.dataclass
class Run:
    """One run of Blender: its pictures float32[seed][height][width][4] (row 0 at the bottom; None of render_layers) and what it
    cost."""

    pictures: numpy.ndarray
    seconds: list  # wall time of each render() call, export and build included
    until_sampling: list  # of these, until the first sample began (None where the engine did not say)
    until_pixels: list  # until the first samples or tiles were done (None where it did not say)
    cpu_seconds: list  # processor time of each render() call, of Blender and all it started; wall time means little on a busy machine
    cpu_until_sampling: list  # of these, until the first sample began (None where the engine did not say)
    statistics: list  # what lambentd said of each render (dict); empty for Cycles
    peak_bytes: int  # largest sum of the proportional memory of Blender and of every process that it started
    log: str


def build_dir():
    """Returns the folder of the build under test."""
    return pathlib.Path(os.environ.get("LAMBENT_BUILD_DIR", k_root / "build" / "release"))


def user_environment(folder):
    """Returns the environment for a Blender whose user folder is `folder`, with the source tree's add-on linked in."""
    addons = folder / "scripts" / "addons"
    addons.mkdir(parents=True, exist_ok=True)
    link = addons / "lambent"
    if not link.is_symlink():
        link.symlink_to(k_root / "blender_addon" / "lambent")
    environment = dict(os.environ)
    environment["BLENDER_USER_SCRIPTS"] = str(folder / "scripts")
    environment["BLENDER_USER_CONFIG"] = str(folder / "config")
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
    return environment


def own_scene(name, folder, case=None):
    """Returns the path of one of the project's own scenes, made by tests/scenes/make_NAME.py unless it is up to date; `case`:
    which, where the script makes several."""
    script = k_root / "tests" / "scenes" / f"make_{name}.py"
    path = folder / (f"{case}.blend" if case else f"{name}.blend")
    newest = max(script.stat().st_mtime, (script.parent / "blocks.py").stat().st_mtime)
    if not path.exists() or path.stat().st_mtime < newest:
        command = ["-b", "--factory-startup", "--python-exit-code", "1", "--python", str(script), "--", str(path)]
        command += [case] if case else []
        run_blender(command, dict(os.environ))
    return path


def read_picture(path):
    """Returns float32[height][width][channel] of an image file, row 0 at the bottom."""
    image = oiio.ImageBuf(str(path))
    pixels = image.get_pixels(oiio.FLOAT)
    if image.has_error or pixels is None:
        raise OSError(f"{path}: {image.geterror()}")
    return numpy.ascontiguousarray(pixels[::-1])


def display(pixels, white):
    """Returns sRGB values of scene-linear ones, `white` mapped to 0.8."""
    value = numpy.clip(pixels[..., :3] * (0.8 / white), 0.0, 1.0)
    return numpy.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)


def write_picture(path, pixels):
    """Writes float[height][width][channel], row 0 at the bottom, as the format that the name's ending says."""
    flipped = numpy.ascontiguousarray(numpy.asarray(pixels, dtype=numpy.float32)[::-1])
    image = oiio.ImageBuf(oiio.ImageSpec(flipped.shape[1], flipped.shape[0], flipped.shape[2], oiio.FLOAT))
    image.set_pixels(oiio.ROI(), flipped)
    if not image.write(str(path), "uint8" if str(path).endswith(".png") else "float"):
        raise OSError(f"{path}: {image.geterror()}")


def processes_below(pid):
    """Returns the process and all that it started, directly or not (list of int)."""
    children = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                with open(f"/proc/{entry}/stat", encoding="utf-8") as file:
                    parent = int(file.read().rpartition(")")[2].split()[1])
            except OSError:
                continue
            children.setdefault(parent, []).append(int(entry))
    found, queue = [], [pid]
    while queue:
        process = queue.pop()
        found.append(process)
        queue.extend(children.get(process, ()))
    return found


def memory_bytes(pid):
    """Returns a process's proportional set size: pages that n processes share count as 1/n in each, so that sums are
    right where the daemon maps what Blender wrote. 0 once it has ended."""
    try:
        with open(f"/proc/{pid}/smaps_rollup", encoding="utf-8") as file:
            return next(int(line.split()[1]) * 1024 for line in file if line.startswith("Pss:"))
    except (OSError, StopIteration):
        return 0


def cpu_seconds(pid):
    """Returns the processor time that a process and all that it started, and has not ended, took so far."""
    ticks = 0
    for process in processes_below(pid):
        try:
            with open(f"/proc/{process}/stat", encoding="utf-8") as file:
                fields = file.read().rpartition(")")[2].split()
        except OSError:
            continue
        ticks += int(fields[11]) + int(fields[12])  # utime and stime
    return ticks / os.sysconf("SC_CLK_TCK")


class MemoryWatch(threading.Thread):
    """Samples the memory of a process and its descendants every 50 ms until it ends; `peak` in bytes."""

    def __init__(self, pid):
        super().__init__(daemon=True)
        self._pid = pid
        self._ended = threading.Event()
        self.peak = 0

    def run(self):
        while not self._ended.wait(0.05):
            self.peak = max(self.peak, sum(memory_bytes(process) for process in processes_below(self._pid)))

    def end(self):
        self._ended.set()
        self.join()
        return self.peak


k_sample = re.compile(r"Sample (\d+)/\d+")


@dataclasses.dataclass
class Line:
    """What Blender printed: when (seconds since its start), and the processor time by then where a milestone is told."""

    when: float
    cpu: float  # or None
    text: str


def run_blender(arguments, environment, blender=None, timeout_s=3600):
    """Runs Blender; returns (lines: [Line], peak bytes). Raises BlenderFailed."""
    command = [blender or os.environ.get("BLENDER", "blender"), *arguments]
    start = time.monotonic()
    process = subprocess.Popen(
        command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        errors="replace",
    )  # fmt: skip
    watch = MemoryWatch(process.pid)
    watch.start()
    killer = threading.Timer(timeout_s, process.kill)
    killer.start()
    lines = []
    for text in process.stdout:
        tells = text.startswith("render_job:") or k_sample.search(text)
        cpu = cpu_seconds(process.pid) if tells else None
        lines.append(Line(time.monotonic() - start, cpu, text.rstrip("\n")))
    code = process.wait()
    killer.cancel()
    peak = watch.end()
    if code != 0:
        tail = "\n".join(line.text for line in lines[-30:])
        raise BlenderFailed(f"{' '.join(command)} ended with code {code}:\n{tail}")
    return lines, peak


@dataclasses.dataclass
class Milestones:
    """Of one render, counted from its start; None where nothing tells."""

    sampling: float = None
    pixels: float = None
    cpu_sampling: float = None
    cpu_end: float = None


def milestones(lines, seed):
    """Returns the Milestones of one render from what Blender printed. Both engines report `Sample n/N`; when a tile of
    Lambent's is in Blender, render_job.py says so."""
    start, found = None, Milestones()
    for line in lines:
        if line.text == f"render_job: start {seed}":
            start = line
        elif start is None:
            continue
        elif line.text == f"render_job: end {seed}":
            found.cpu_end = line.cpu - start.cpu
            break
        else:
            sample = k_sample.search(line.text)
            if sample and found.sampling is None:
                found.sampling, found.cpu_sampling = line.when - start.when, line.cpu - start.cpu
            if found.pixels is None and (line.text == "render_job: pixels" or (sample and int(sample.group(1)) > 0)):
                found.pixels = line.when - start.when
    return found


# Of tests/scenes/make_passes.py: those that passes of shadows are about.
k_shadow_objects = ("Glass", "Diffuse")


def render(scene, engine, seeds, samples, width, folder, blender=None, variant="", settings=None, timeout_s=3600):
    """Renders a .blend with one engine, once a seed, in one run of Blender; returns the Run. Pictures, job and log stay
    in `folder`. The arguments are those of the job that render_job.py describes."""
    job = {"engine": engine, "width": width, "samples": samples, "seeds": list(seeds), "variant": variant, "settings": settings or {}}
    run = run_job(scene, job, folder, blender, timeout_s)
    run.pictures = numpy.stack([read_picture(path) for path in picture_paths(engine, seeds, folder)])
    return run


def render_layers(
    scene, engine, seeds, samples, width, folder, blender=None, settings=None, layer_settings=None, balance=None, objects=None, timeout_s=3600
):
    """As render, with all view layers and passes; returns (pictures, attributes, run): {layer: {pass: float32[seed][height]
    [width][channel]}} by the names of Blender 5, and {attribute: value} of the first seed's file. layer_settings: of the first
    layer's own settings for Lambent; balance: factors of light groups; objects: {"mattes", "removed" or "camera_only": [names]}."""
    job = {
        "engine": engine, "width": width, "samples": samples, "seeds": list(seeds), "variant": "", "settings": settings or {},
        "layers": True, "layer_settings": layer_settings or {}, "balance": balance or {}, "shadow_objects": k_shadow_objects, **(objects or {}),
    }  # fmt: skip
    run = run_job(scene, job, folder, blender, timeout_s)
    return *read_layers(engine, seeds, folder), run


def read_layers(engine, seeds, folder):
    """Returns (pictures, attributes) as render_layers, of the files that it left in a folder."""
    files = [multilayer.read(path) for path in picture_paths(engine, seeds, folder)]
    pictures = {
        layer: {name: numpy.stack([layers[layer][name] for layers, _ in files]) for name in passes}
        for layer, passes in files[0][0].items()
    }
    return pictures, files[0][1]


def picture_paths(engine, seeds, folder):
    """Returns where a run of an engine leaves its pictures."""
    return [folder / f"{engine.lower()}_{seed}.exr" for seed in seeds]


def run_job(scene, job, folder, blender=None, timeout_s=3600):
    """Runs a job of render_job.py on a .blend in one run of Blender; returns the Run without pictures, which stay in `folder`
    with the job and the log."""
    folder.mkdir(parents=True, exist_ok=True)
    engine, seeds = job["engine"], job["seeds"]
    prefix = str(folder / f"{engine.lower()}_")
    job = {"daemon": str(build_dir() / "bin" / "lambentd"), "height": None, "out": prefix, **job}
    job_file = folder / f"{engine.lower()}_job.json"
    job_file.write_text(json.dumps(job), encoding="utf-8")
    arguments = ["-b", "--factory-startup", str(scene), "--python-exit-code", "1"]
    arguments += ["--python", str(k_render_job), "--", str(job_file)]
    lines, peak = run_blender(arguments, user_environment(folder / "user"), blender, timeout_s)
    log = "\n".join(f"{line.when:9.3f} {line.text}" for line in lines)
    (folder / f"{engine.lower()}.log").write_text(log, encoding="utf-8")
    result_file = pathlib.Path(f"{prefix}result.json")
    result = json.loads(result_file.read_text(encoding="utf-8"))
    marks = [milestones(lines, seed) for seed in seeds]
    return Run(
        pictures=None,
        seconds=result["seconds"],
        until_sampling=[mark.sampling for mark in marks],
        until_pixels=[mark.pixels for mark in marks],
        cpu_seconds=[mark.cpu_end for mark in marks],
        cpu_until_sampling=[mark.cpu_sampling for mark in marks],
        statistics=result["statistics"],
        peak_bytes=peak,
        log=log,
    )
