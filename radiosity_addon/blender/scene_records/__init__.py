"""What a scene holds, as plain records: meshes at places, roles, light groups, render settings.

Also where each exported triangle came from.
"""
