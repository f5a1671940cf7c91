# Detachment folds: a wall shortens bonded beds that slide on a frictionless layer
# -----------------------------------------------------------------------------
# shows     box folds along the whole length, 4 to 6 km apart: the bed at 1.3 km rises by 0.7 km in each third of
#           the model and dips up to 40 degrees both ways; nearly half of the wall's displacement reaches the middle
# model     24 km long, 2.1 km thick, the lowest 500 m without bonds and friction; about 5800 spheres of radius 45
#           and 60 m
# run       ./scripts/run examples/detachment.py       (about a minute on two cores)
# results   examples/data: a frame every km of shortening, walls.csv (the force on the wall), a figure of the last
#           frame
# -----------------------------------------------------------------------------
START
SET disk off                            # spheres: mass 4/3 pi r^3 x density
SET seed 41
SET gentry 2.75                         # attempts per requested particle

BOX left -100.0 right 24100.0 bottom -100.0 height 4700.0
WALL id 0 nodes (0.0, 0.0) (24000.0, 0.0)            color black
WALL id 1 nodes (0.0, 4600.0) (0.0, 0.0)             color blue
WALL id 2 nodes (24000.0, 0.0) (24000.0, 4600.0)     color red

# As many random particles as fit; then a flat top at 2.1 km.
GEN NUM 60000 rad discrete 45.0 60.0 x (0.0, 24000.0) y (0.0, 4600.0) group cover
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0
SET gravity 0.0 -9.8
SET dt 0.03
SET print 0                             # frames only during the push
CYC 5000
DEL range y 2100.0 99999.0
CYC 1500

# Salt: light, without bonds or friction. The rest of the group has weak bonds.
PROP density 2200.0 group salt range y -100.0 500.0
PROP ebmod 2e8 gbmod 2e8 tstrength 3e6 sstrength 6e6 fric 0.3 range group cover

# Beds of 320 m.
PROP color violet range group salt
PROP color green  range y  500.0  820.0
PROP color lg     range y  820.0 1140.0
PROP color yellow range y 1140.0 1460.0
PROP color mg     range y 1460.0 1780.0
PROP color gb     range y 1780.0 9999.0

# A quarter of the length at 2 m/s. The floor remains frictionless.
WALL id 1 fric 0.1 xv 2.0
WALL id 2 fric 0.1
IMPLE wall id 1 xmove 6000.0 print 1000.0
STOP
