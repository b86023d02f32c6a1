"""Materials as radiosity sees them: what shader nodes reflect, emit and let through.

Reads node trees; changes nothing.
"""
