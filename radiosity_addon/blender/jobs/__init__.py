"""A bake as a job: in one go in scripts, in turns in a window; inspection before, preview after.

The work itself runs in a thread and touches no `bpy`.
"""
