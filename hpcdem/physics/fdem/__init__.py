"""Blocks that deform, crack and collide: the combined finite-discrete element method. The method can be read in
simulation.py: state, step, rebuild. What a model is made of is in definition.py, the tables of kernels are made in
local.py."""
