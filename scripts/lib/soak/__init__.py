"""A run of millions of steps that does everything, and what must not grow or drift in it. Started by `scripts/soak`."""
