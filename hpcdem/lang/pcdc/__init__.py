"""The PCDC language: Python in which lines that begin with ``pcdc`` are commands."""
