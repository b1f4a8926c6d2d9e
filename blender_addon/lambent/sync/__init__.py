# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Blender's evaluated scene as edits of the wire. One file for each kind of datablock; scene.py walks them all."""
