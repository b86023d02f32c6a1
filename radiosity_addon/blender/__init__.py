"""The only layer that knows Blender: scene in, lightmaps out, and the front doors."""
