"""Blender's datablocks: what a bake made or changed, and reading meshes and images.

Knows nothing of bakes in progress.
"""
