"""Blender's datablocks: the record of a bake's changes, and reading meshes and images.

Knows nothing of bakes in progress.
"""
