# Angle of repose: a wall is withdrawn from a column of sand
# -----------------------------------------------------------------------------
# shows     a slope of 41 degrees in sand of friction 0.3. With 0.1 it is 12,
#           with 0.2 27 and with 0.5 56 degrees: change PROP and WALL below, and
#           use a longer floor and displacement for low friction
# model     column 15 mm wide and 17 mm high, 1750 discs that do not rotate
# run       ./scripts/run examples/angle_of_repose.py     (half a minute)
# results   examples/data: frames every 4 mm of wall displacement, walls.csv,
#           a figure of the slope
# -----------------------------------------------------------------------------
# Rotation is fixed: round grains would roll and form a much lower slope. This
# represents the interlocking of angular grains. The parameters are those of a
# published sandbox (Li et al. 2021); docs/validation.md compares its angles
# with ours.
START
SET disk hex                            # mass: density x cell of a close packing
SET frac 0.3                            # time step from mass and stiffness
SET gravity 0.0 -10.0
SET seed 3
SET print 0

WALL id 1 nodes (0.0, 50e-3) (0.0, 0.0)     kn 1.5e4 ks 1.5e4 color black
WALL id 2 nodes (0.0, 0.0) (46e-3, 0.0)     kn 1.5e4 ks 1.5e4 color black
WALL id 3 nodes (15e-3, 50e-3) (15e-3, 0.0) kn 1.5e4 ks 1.5e4 color blue

# Loose grains of four sizes, twice as many small ones, settle without friction
# to a dense packing.
GEN grid rad discrete 0.1e-3 0.1e-3 0.2e-3 0.2e-3 0.25e-3 0.3e-3 x (0.0, 15e-3) y (0.0, 42e-3)
PROP density 1.3e3 kn 1.5e4 ks 1.5e4 damp 0.4 fric 0.0
FIX spin
CYC 18000

# Shorter walls, marker beds
WALL id 1 nodes (0.0, 18e-3) (0.0, 0.0)     kn 1.5e4 ks 1.5e4 color black
WALL id 3 nodes (15e-3, 18e-3) (15e-3, 0.0) kn 1.5e4 ks 1.5e4 color blue
PROP color lg
PROP color red  range y  3e-3  4e-3
PROP color blue range y  6e-3  7e-3
PROP color red  range y  9e-3 10e-3
PROP color blue range y 12e-3 13e-3
PROP color red  range y 15e-3 16e-3

# Friction of grains and floor; the wall moves away at 40 mm/s, slowly enough for
# the sand to follow. When it stops, the sand is nearly at rest.
PROP fric 0.3
WALL id 2 fric 0.3
WALL id 3 xv 40e-3
IMPLE wall id 3 xmove 28e-3 print 4e-3
STOP
