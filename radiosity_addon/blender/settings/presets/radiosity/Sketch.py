"""To place lamps: the fastest light."""

import bpy

settings = bpy.context.scene.radiosity

settings.resolution = 256
settings.texel_density = 8.0
settings.max_resolution = 2048
settings.quality = "sketch"
