"""Fingerprints of all that a set of models writes (scripts/digests), to show that a change of structure kept them."""
