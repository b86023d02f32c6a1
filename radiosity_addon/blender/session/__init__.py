"""What this session of Blender remembers: the running bake, the last one, whether Live is on.

Nothing here is part of the file.
"""
