"""The solvers, one a file, one interface: `solve(scene, settings)` returns a `Solution`."""
