"""From triangles to lightmap pages: unwrap, texels, light at texels, images.

Its rooms are used directly; this package exports nothing.
"""
