# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Lambent for Blender: renders through the daemon lambentd. Works as a legacy add-on (3.4) and as an extension (4.2+)."""

bl_info = {
    "name": "Lambent",
    "author": "Lambent contributors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Render Properties > Render Engine > Lambent",
    "description": "Production renderer with a daemon of its own",
    "category": "Render",
}

import atexit

import bpy
from bpy.app.handlers import persistent

from . import ui
from .render import engine, report, session, viewport


@persistent
def _forget_file(*_):
    """Another file was opened: what the daemon holds belongs to the last one."""
    viewport.close_all()
    session.close_sessions()
    report.clear()


_engine_watch = object()


@persistent
def _expect_render(*_):
    """A file was opened: if it renders with Lambent, the daemon starts now; else when Lambent is chosen."""
    bpy.msgbus.clear_by_owner(_engine_watch)
    bpy.msgbus.subscribe_rna(
        key=(bpy.types.RenderSettings, "engine"), owner=_engine_watch, args=(), notify=_expect_render_if_chosen
    )
    _expect_render_if_chosen()


def _expect_render_if_chosen():
    scene = getattr(bpy.context, "scene", None)  # there is none while add-ons are registered
    if scene is not None:
        _expect_render_of(scene)


@persistent
def _expect_render_of(scene, *_):
    """As a handler: a render begins, wherever it was asked for. The daemon starts while Blender still evaluates the scene."""
    if scene.render.engine == engine.LambentRenderEngine.bl_idname:
        session.expect_render()


def register():
    """Blender calls this when the add-on is enabled."""
    ui.register()
    engine.register()
    bpy.app.handlers.load_pre.append(_forget_file)
    bpy.app.handlers.load_post.append(_expect_render)
    bpy.app.handlers.render_init.append(_expect_render_of)
    _expect_render()
    atexit.register(session.close_all)


def unregister():
    """Blender calls this when the add-on is disabled."""
    atexit.unregister(session.close_all)
    bpy.app.handlers.load_pre.remove(_forget_file)
    bpy.app.handlers.load_post.remove(_expect_render)
    bpy.app.handlers.render_init.remove(_expect_render_of)
    bpy.msgbus.clear_by_owner(_engine_watch)
    viewport.close_all()
    engine.unregister()
    ui.unregister()
    session.close_all()
