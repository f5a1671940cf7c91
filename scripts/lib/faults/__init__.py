"""A fault campaign: small runs are disturbed, gone on with, and compared with the undisturbed run."""
