"""The only layer that imports `bpy`: scene in, lightmaps out, operators, panels, command line.

Its rooms are used module by module, so that registering loads neither NumPy nor the solver.
"""
