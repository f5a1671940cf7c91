"""Particles: what they are, how they are stepped, what can be asked of them. simulation.py shows the method."""
