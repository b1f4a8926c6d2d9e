# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The zip, installed the way users do: as a legacy add-on before 4.2, as an extension since."""

import os
import subprocess

from harness import FAKE_DAEMON, ROOT

INSTALL = """
import sys, bpy
zip_path, daemon = {zip_path!r}, {daemon!r}
if bpy.app.version >= (4, 2, 0):
    module = 'bl_ext.user_default.lambent'
    bpy.ops.extensions.package_install_files(filepath=zip_path, repo='user_default', enable_on_install=True)
else:
    module = 'lambent'
    bpy.ops.preferences.addon_install(filepath=zip_path)
    bpy.ops.preferences.addon_enable(module=module)
print('MODULE', module, sys.modules[module].__file__)
preferences = bpy.context.preferences.addons[module].preferences
scene = bpy.context.scene
scene.render.engine = 'LAMBENT'
scene.render.resolution_percentage = 10
preferences.daemon_path = '/nowhere/lambentd'
try:
    bpy.ops.render.render()
except RuntimeError as error:
    print('EXPECTED', error)
preferences.daemon_path = daemon
print('FIRST', bpy.ops.render.render())
bpy.ops.preferences.addon_disable(module=module)
assert not hasattr(bpy.types.Scene, 'lambent') and not hasattr(bpy.types, 'LAMBENT_RENDER_PT_sampling')
theirs = [panel for panel in bpy.types.Panel.__subclasses__() if not panel.__module__.startswith(module)]
assert len(theirs) > 100 and not any('LAMBENT' in getattr(panel, 'COMPAT_ENGINES', ()) for panel in theirs)
bpy.ops.preferences.addon_enable(module=module)
# Blender forgets the preferences of an add-on that is disabled.
bpy.context.preferences.addons[module].preferences.daemon_path = daemon
scene.render.engine = 'LAMBENT'
print('SECOND', bpy.ops.render.render())
bpy.ops.script.execute_preset(
    filepath=__import__('os').path.join(sys.modules[module].__path__[0], 'presets', 'Interior.py'),
    menu_idname='LAMBENT_MT_render_presets',
)
print('PRESET', scene.lambent.samples, scene.lambent.max_bounces)
"""


def test_the_zip_installs_enables_renders_and_can_be_disabled(run_blender, tmp_path):
    zip_path = tmp_path / "lambent-addon.zip"
    subprocess.run(["/usr/bin/python3", os.path.join(ROOT, "packaging", "make_addon_zip"), str(zip_path)], check=True)
    folders = {}
    for name in ("CONFIG", "SCRIPTS", "EXTENSIONS", "DATAFILES", "RESOURCES"):
        (tmp_path / name).mkdir()
        folders[f"BLENDER_USER_{name}"] = str(tmp_path / name)
    # The daemon of the preferences counts when the variable is empty.
    run = run_blender(
        INSTALL.format(zip_path=str(zip_path), daemon=FAKE_DAEMON), prelude=False, environment=folders, daemon=""
    )
    assert "Traceback" not in run.output and run.code == 0, run.output
    module_file = run.output.split("MODULE ")[1].split()[1]
    assert module_file.startswith(str(tmp_path))
    assert "/nowhere/lambentd" in run.output.split("EXPECTED ")[1]
    assert "FIRST {'FINISHED'}" in run.output and "SECOND {'FINISHED'}" in run.output
    assert "PRESET 1024 24" in run.output


def test_extension_and_legacy_add_on_carry_the_same_version():
    import re

    folder = os.path.join(ROOT, "blender_addon", "lambent")
    with open(os.path.join(folder, "blender_manifest.toml")) as file:
        manifest = re.search(r'^version = "(.*)"$', file.read(), re.M).group(1)
    with open(os.path.join(folder, "__init__.py")) as file:
        legacy = ".".join(re.search(r'"version": \((.*)\)', file.read()).group(1).split(", "))
    with open(os.path.join(folder, "render", "session.py")) as file:
        announced = re.search(r'^VERSION = "(.*)"$', file.read(), re.M).group(1)
    assert manifest == legacy == announced
