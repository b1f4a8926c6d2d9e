# SPDX-FileCopyrightText: 2026 Lambent contributors
# SPDX-License-Identifier: GPL-3.0-or-later

import bpy

lambent = bpy.context.scene.lambent
lambent.samples = 512
lambent.time_limit = 0.0
lambent.noise_threshold = 0.0
lambent.max_bounces = 12
lambent.diffuse_bounces = 4
lambent.glossy_bounces = 4
lambent.transmission_bounces = 12
lambent.transparent_bounces = 8
