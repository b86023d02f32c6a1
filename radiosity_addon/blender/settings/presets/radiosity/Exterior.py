"""Houses and grounds: as many pages as eight texels a metre take, apart when seen from afar."""

import bpy

settings = bpy.context.scene.radiosity

settings.size_mode = "density"
settings.resolution = 1024
settings.texel_density = 8.0
settings.max_resolution = 4096
settings.mip_levels = 2
settings.quality = "medium"
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
