"""Lightmap pages as Blender images and files, and the node groups that show them.

Also the lightmaps of light groups and their mixer.
"""
