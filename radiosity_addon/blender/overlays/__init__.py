"""Overlays in the 3D viewports: elements, links, density, error, false color.

Numbers come from the last bake and from the lightmaps.
"""
