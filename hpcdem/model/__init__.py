"""What a model consists of: particles, materials, bond types, walls, settings. Data only; no MPI, no
files."""
