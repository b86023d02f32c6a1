"""To judge the light: seconds."""

import bpy

settings = bpy.context.scene.radiosity

settings.size_mode = "resolution"
settings.resolution = 256
settings.texel_density = 8.0
settings.max_resolution = 2048
settings.mip_levels = 0
settings.quality = "draft"
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
