# Fault at depth: a basement block moves up a reverse fault and folds the beds above it
# -----------------------------------------------------------------------------
# shows     a fault-propagation fold: the fault carries the green bed 1.0 km over itself and the yellow one 0.7 km,
#           and dies out in the red one, which is overturned; the surface forms a step of 1.4 km
# model     12 km long, 1.7 km of bonded beds over two rigid blocks of basement, made of the same spheres: the right
#           one moves up a fault that dips 50 degrees to the right; about 6200 spheres of radius 40 and 50 m
# run       ./scripts/run examples/fault.py       (under a minute on two cores)
# results   examples/data: a frame every 300 m of heave, a figure of the last frame
# -----------------------------------------------------------------------------
START
SET disk off                            # spheres: mass 4/3 pi r^3 x density
SET seed 45
SET gentry 2.75                         # attempts per requested particle

# No BOX: the walls confine everything. The floor is deeper on the right, so that the block there is thick enough
# when it rises by 1.43 km.
WALL id 0 nodes (   0.0,     0.0) ( 6600.0,     0.0) color black
WALL id 3 nodes (6600.0,     0.0) ( 7800.0, -1430.0) color black
WALL id 4 nodes (7800.0, -1430.0) (12000.0, -1430.0) color black
WALL id 1 nodes (   0.0,  6500.0) (    0.0,     0.0) color blue
WALL id 2 nodes (12000.0, -1430.0) (12000.0, 6500.0) color red

# As many random particles as fit; then a flat top at 2.8 km.
GEN NUM 60000 rad discrete 40.0 50.0 x (   0.0, 12000.0) y (    0.0, 6500.0) group cover
GEN NUM 20000 rad discrete 40.0 50.0 x (7800.0, 12000.0) y (-1430.0,    0.0) group cover
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0
SET gravity 0.0 -9.8
SET dt 0.025
SET print 0                             # frames only while the fault moves
CYC 6000
DEL range y 2800.0 99999.0
CYC 2000

# Basement below 1.1 km. The hanging wall lies to the right of the fault from (5600, 1100) to (6523, 0) and further
# down: 50 degrees.
PROP color mg    group foot range y -9999.0 1100.0
PROP color black group hang range group foot and P4 (8026, -1791) (13000, -1791) (13000, 1608) (5174, 1608)
PROP fric 0.3 xv 0.0 yv 0.0 spin 0.0 range group foot and group hang
FIX x y spin range group foot and group hang

# The beds above.
PROP ebmod 2e8 gbmod 2e8 tstrength 3e6 sstrength 6e6 fric 0.3 range group cover
PROP color lg     range group cover
PROP color green  range group cover and y 1100.0 1400.0
PROP color yellow range group cover and y 1700.0 2000.0
PROP color red    range group cover and y 2300.0 2600.0

# The blocks now need no support: a plane floor, and lower sides for a smaller figure.
WALL id 3 nodes ( 6600.0,    0.0) ( 7800.0,    0.0) color black
WALL id 4 nodes ( 7800.0,    0.0) (12000.0,    0.0) color black
WALL id 1 nodes (    0.0, 4800.0) (    0.0,    0.0) color blue
WALL id 2 nodes (12000.0,    0.0) (12000.0, 4800.0) color red

# 2 m/s along the fault: cos 50, sin 50. The right side moves with the block.
PROP xv -1.2856 yv 1.5321 range group hang
WALL id 2 xv -1.2856
IMPLE wall id 2 xmove -1200.0 print 300.0
STOP
