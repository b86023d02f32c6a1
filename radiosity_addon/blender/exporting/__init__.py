"""Exports for engines: a temporary scene with the lightmaps as engines want them, written as glTF.

Imported module by module, as all rooms of the Blender side.
"""
