"""Particles: what they are, how they are stepped, what can be asked of them. The method is in engine/model.py."""
