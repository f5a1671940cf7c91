"""Liners on free faces of blocks: beams that bend and stretch, bound to the rock by springs that can part and slip."""
