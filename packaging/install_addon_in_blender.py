# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by packaging/install_addon inside Blender: installs the zip, enables the add-on, stores the daemon's path.

    blender -b --python install_addon_in_blender.py -- ZIP DAEMON

Prints one line that begins with `install_addon: `; raises when anything fails.
"""

import pathlib
import sys
import zipfile

import addon_utils
import bpy

k_extensions_since = (4, 2, 0)
k_repository = "user_default"  # the extension repository "User Default", for files installed from disk


def same_as_installed(archive_path, folder):
    """Returns whether `folder` holds each file of the zip's `lambent/` with the same content."""
    if folder is None or not folder.is_dir():
        return False
    with zipfile.ZipFile(archive_path) as archive:
        for name in archive.namelist():
            installed = folder / pathlib.PurePosixPath(name).relative_to("lambent")
            if not installed.is_file() or installed.read_bytes() != archive.read(name):
                return False
    return True


def add_on_folder(module):
    """Returns the folder (Path) that the add-on `module` is installed in, or None."""
    for found in addon_utils.modules():
        if found.__name__ == module:
            return pathlib.Path(found.__file__).parent
    return None


def install(archive_path, module):
    if bpy.app.version >= k_extensions_since:
        bpy.ops.extensions.package_install_files(filepath=archive_path, repo=k_repository, enable_on_install=True)
    else:
        bpy.ops.preferences.addon_install(filepath=archive_path, overwrite=True)
        addon_utils.modules_refresh()
    if module not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=module)
    if module not in bpy.context.preferences.addons:
        raise RuntimeError(f"Blender did not enable {module}")


def main():
    archive_path, daemon_path = sys.argv[sys.argv.index("--") + 1 :]
    extension = bpy.app.version >= k_extensions_since
    module = f"bl_ext.{k_repository}.lambent" if extension else "lambent"

    addons = bpy.context.preferences.addons
    up_to_date = module in addons and same_as_installed(archive_path, add_on_folder(module))
    if not up_to_date:
        install(archive_path, module)

    preferences = addons[module].preferences
    if preferences.daemon_path != daemon_path or not up_to_date:
        preferences.daemon_path = daemon_path
        bpy.ops.wm.save_userpref()
        done = "installed in"
    else:
        done = "is already in"
    print(f"install_addon: the add-on {done} Blender {bpy.app.version_string}: {add_on_folder(module)}")


main()
