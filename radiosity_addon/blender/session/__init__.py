"""What this session of Blender remembers: one object (`state.py`), and a scene's memory of its last bake.

Also work in a thread, and redrawing.
"""
