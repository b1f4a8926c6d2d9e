# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The wire format and the daemon: standard library and numpy only, never bpy (so it runs and is tested outside Blender)."""
