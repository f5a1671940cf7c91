"""Meshes for blocks: geometry layers, gmsh, structured meshes, import, fractures, quality.

Everything here takes and returns plain data (`geometry.Layers`, `fractures.Fractures`, `model.blocks.mesh.Mesh`); with
several ranks the first makes it and the others are sent it (`Comm.per_node`). What needs a package that is not always
installed says which (`optional`).
"""
