"""Stand-ins: meshes and objects that show a lightmap where the user's own cannot.

And what follows from that for names, parents and references.
"""
