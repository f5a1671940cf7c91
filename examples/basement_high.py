# Basement high: thrusts meet a fixed horst
# -----------------------------------------------------------------------------
# shows     two thrusts in front of the high, none behind it: the upper one climbs its slope and carries the red bed
#           1 km over itself; the mean uplift is 1 km in front of the high and zero behind it
# model     22 km long, 2.2 km thick, with a fixed trapezium of 1.2 km under the middle; about 5600 spheres of radius
#           45 and 60 m
# run       ./scripts/run examples/basement_high.py       (under a minute on two cores)
# results   examples/data: a frame every km of shortening, walls.csv (the force on the wall), a figure of the last
#           frame
# -----------------------------------------------------------------------------
START
SET disk off                            # spheres: mass 4/3 pi r^3 x density
SET seed 42
SET gentry 2.75                         # attempts per requested particle

BOX left -100.0 right 22100.0 bottom -100.0 height 5200.0
WALL id 0 nodes (0.0, 0.0) (22000.0, 0.0)            color black
WALL id 1 nodes (0.0, 5000.0) (0.0, 0.0)             color blue
WALL id 2 nodes (22000.0, 0.0) (22000.0, 5000.0)     color red

# As many random particles as fit; then a flat top at 2.2 km.
GEN NUM 60000 rad discrete 45.0 60.0 x (0.0, 22000.0) y (0.0, 5000.0) group cover
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0
SET gravity 0.0 -9.8
SET dt 0.03
SET print 0                             # frames only during the push
CYC 5000
DEL range y 2200.0 99999.0
CYC 1500

# The lowest 300 m are weak: no bonds, little friction. Above: bonded rock.
PROP color yellow fric 0.1 group weak range y -100.0 300.0
PROP ebmod 2e8 gbmod 2e8 tstrength 1e7 sstrength 2e7 fric 0.3 range group cover

# Marker beds of 250 m.
PROP color lg     range group cover
PROP color green  range y  600.0  850.0
PROP color red    range y 1100.0 1350.0
PROP color mg     range y 1600.0 1850.0
PROP color gb     range y 2000.0 9999.0

# The high is part of the bed and fixed: FIX keeps the velocity, which is therefore set to zero first. Its corners
# are given in order around it.
PROP color black fric 0.3 group high range P4 (10500.0, -100.0) (15500.0, -100.0) (13800.0, 1200.0) (12200.0, 1200.0)
BOND break range group high
PROP xv 0.0 yv 0.0 spin 0.0 range group high
FIX x y spin range group high

# 5 km at 2 m/s.
WALL id 0 fric 0.1
WALL id 1 fric 0.1 xv 2.0
WALL id 2 fric 0.1
IMPLE wall id 1 xmove 5000.0 print 1000.0
STOP
