"""Arithmetic of contacts between discs and faces."""
