# Flow down a rough chute without an end: periodic sides
# -----------------------------------------------------------------------------
# shows     a layer of discs on a slope of 22 degrees; what leaves through the
#           right side enters through the left one. The stripes show the shear
# model     4 m long, layer 1.4 m thick, 770 discs of radius 4 and 5 cm
# run       ./scripts/run examples/chute.py        (under a minute)
# results   examples/data: frames, mean stresses hist_1.csv to hist_3.csv
# -----------------------------------------------------------------------------
START
SET seed 3

# BOX loses its left and right wall, its floor and lid continue without an end.
BOX left 0.0 right 4.0 bottom 0.0 height 3.0 kn=1e7 ks=5e6 fric 0.5
PERIODIC x (0.0, 4.0)

# A rough bed: a row of discs that closes across the sides.
GLINE p1 (0.05, 0.05) p2 (3.96, 0.05) rad 0.05 kn=1e7 ks=5e6 fric=0.5 color black group bed
FIX x y spin range group bed

GEN num 5000 rad discrete 0.04 0.05 x (0.0, 4.0) y (0.1, 2.4) group sand
PROP density 2500.0 kn 1e7 ks 5e6 fric 0.5
SET restitution 0.3
SET dt 4e-5
SET gravity 0.0 -9.81
CYC 20000                               # settle
PROP color yellow range group sand
PROP color red range x (0.0, 0.5) group sand
PROP color blue range x (2.0, 2.5) group sand

# A slope of 22 degrees: gravity is inclined, the model stays level.
SET gravity 3.675 -9.096
HIST id 1 interval 500, sxx
HIST id 2 interval 500, syy
HIST id 3 interval 500, sxy
SET print 10000
CYC 50000
STOP
