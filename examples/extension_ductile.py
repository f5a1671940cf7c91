# Extension over a ductile base: tilted blocks above a stretching row of particles
# -----------------------------------------------------------------------------
# shows     the base stretches evenly, from 8 to 12 km; the beds above break into blocks of 1 to 2 km that tilt by up
#           to 18 degrees to the left and 12 to the right; the first fill lies in the half-grabens between them
# model     13 km long, 2.2 km thick, on a row of bonded particles; its ends are pulled apart and its middle, free to
#           move along x, stretches evenly; about 4200 spheres of radius 45 and 60 m at the end
# run       ./scripts/run examples/extension_ductile.py       (under a minute on two cores)
# results   examples/data: a frame every 500 m of the right wall and one after each filling, a figure of the last frame
# -----------------------------------------------------------------------------
START
SET disk off                            # spheres: mass 4/3 pi r^3 x density
SET seed 44
SET gentry 2.75                         # attempts per requested particle

BOX left -2100.0 right 15100.0 bottom -100.0 height 5000.0
WALL id 1 nodes (0.0, 4800.0) (0.0, 0.0)             color blue
WALL id 2 nodes (13000.0, 0.0) (13000.0, 4800.0)     color red

# The base: centres half a diameter apart, so that the stretched row has no gaps.
GLINE p1 (0.0, 0.0) p2 (13000.0, 0.0) rad 60.0 cratio 0.5 group middle color red
FIX x y spin

# As many random particles as fit; then a flat top at 2.2 km.
GEN NUM 60000 rad discrete 45.0 60.0 x (0.0, 13000.0) y (60.0, 4800.0) group cover
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0
SET gravity 0.0 -9.8
SET dt 0.03
SET print 0
CYC 5000
DEL range y 2200.0 99999.0
CYC 1500

PROP ebmod 2e8 gbmod 2e8 tstrength 6e6 sstrength 1.2e7 fric 0.4 range group cover

# Marker beds of 300 m.
PROP color lg range group cover
PROP color mg range y  400.0  700.0
PROP color mg range y 1000.0 1300.0
PROP color mg range y 1600.0 1900.0

# The two ends of the base, 2.5 km each, are driven; the middle is free in x. rext 0.5 bonds next neighbours only
# (cratio 0.5); these bonds never break.
PROP fric 0.4 range group middle
PROP color black group west range group middle and x  -100.0  2500.0
PROP color black group east range group middle and x 10500.0 13100.0
PROP ebmod 2e8 gbmod 2e8 tstrength 1e99 sstrength 1e99 rext 0.5 range group west and group middle
PROP ebmod 2e8 gbmod 2e8 tstrength 1e99 sstrength 1e99 rext 0.5 range group east and group middle
FREE x range group middle

# First stage: each side moves by 1 km at 1 m/s, then rest and filling of the half-grabens: new particles, cut slightly
# below the old surface.
PROP xv -1.0 range group west
PROP xv  1.0 range group east
WALL id 1 xv -1.0
WALL id 2 xv  1.0
IMPLE wall id 2 xmove 1000.0 print 500.0
PROP xv 0.0 range group west and group east
WALL id 1 xv 0.0
WALL id 2 xv 0.0
GEN NUM 20000 rad discrete 45.0 60.0 x (1000.0, 12000.0) y (800.0, 3600.0) group fill1
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.3 color yellow range group fill1
CYC 2500
DEL range group fill1 and y 2150.0 99999.0
CYC 500

# Second stage: each side moves by 1 km at 1 m/s, then rest and filling.
PROP xv -1.0 range group west
PROP xv  1.0 range group east
WALL id 1 xv -1.0
WALL id 2 xv  1.0
IMPLE wall id 2 xmove 1000.0 print 500.0
PROP xv 0.0 range group west and group east
WALL id 1 xv 0.0
WALL id 2 xv 0.0
GEN NUM 20000 rad discrete 45.0 60.0 x (500.0, 12500.0) y (800.0, 3600.0) group fill2
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.3 color gb range group fill2
CYC 2500
DEL range group fill2 and y 2150.0 99999.0
CYC 500

CYC 1                                   # writes a last frame at its start
STOP
