"""Houses and grounds: as many pages as eight texels a meter take, apart when seen from afar."""

import bpy

settings = bpy.context.scene.radiosity

settings.size_mode = "density"
settings.resolution = 1024
settings.texel_density = 8.0
settings.max_resolution = 4096
settings.mip_levels = 2
