"""Blocks that deform, crack and collide: the combined finite-discrete element method. The phases of a step are in
simulation.py, their order in engine/model.py. What a model is made of is in definition.py, the tables of kernels are
made in local.py."""
