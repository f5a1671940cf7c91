"""Arithmetic of particles: laws, lists, loops over pairs and walls, motion. Knows no ranks, files or figures."""
