"""Moisture of soil: its diffusion in elements, shrinkage, and the suction that goes with it."""
