"""Rooms seen from close: one page of clean light."""

import bpy

settings = bpy.context.scene.radiosity

settings.resolution = 1024
settings.max_resolution = 4096
