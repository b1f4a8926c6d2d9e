# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""The rendered viewport."""


class ViewportRender:
    """Says that the viewport is not there yet."""

    def __init__(self, engine):
        self._engine = engine

    def update(self, context, depsgraph):
        self._engine.update_stats("Lambent", "press F12")

    def draw(self, context, depsgraph):
        self._engine.update_stats("Lambent", "press F12")

    def close(self):
        pass
