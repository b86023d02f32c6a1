"""To be looked at for long: fine shadows, charts apart down to the second mip level."""

import bpy

settings = bpy.context.scene.radiosity

settings.resolution = 2048
settings.texel_density = 128.0
settings.max_resolution = 8192
settings.mip_levels = 2
settings.quality = "high"
