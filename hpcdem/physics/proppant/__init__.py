"""Proppant in the fluid of joints."""
