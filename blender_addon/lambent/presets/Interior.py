# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

import bpy

lambent = bpy.context.scene.lambent
lambent.samples = 1024
lambent.time_limit = 0.0
lambent.noise_threshold = 0.0
lambent.max_bounces = 24
lambent.diffuse_bounces = 16
lambent.glossy_bounces = 8
lambent.transmission_bounces = 16
lambent.transparent_bounces = 16
