"""Arithmetic of blocks that deform, crack and collide: laws, loops over elements, joints and contacts."""
