"""To be looked at for long: fine shadows, charts apart down to the second mip level."""

import bpy

settings = bpy.context.scene.radiosity

settings.size_mode = "resolution"
settings.resolution = 2048
settings.texel_density = 128.0
settings.max_resolution = 8192
settings.mip_levels = 2
settings.quality = "high"
settings.relative_error = 0.02
settings.method = "hierarchical"
settings.elements = 0
settings.assembly = "galerkin"
settings.patches = 0
settings.contrast = 0.0
settings.form_factor_error = 0.0
settings.error = 0.0
settings.min_area = 0.0
settings.max_links = 0
settings.ambient = False
settings.tolerance = 0.0
settings.max_iterations = 0
