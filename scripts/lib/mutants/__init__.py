"""Mutants: small seeded changes of the sources, and the tests that notice them."""
