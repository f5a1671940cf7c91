# Sedimentation and erosion: thrusts grow while their crests are eroded and the foreland is filled
# -----------------------------------------------------------------------------
# shows     a first thrust, which carries the grey bed 2 km over itself and is eroded down to its lower half, with
#           deposits that end against its front; 5 km further on a younger pop-up lifts both deposits by 0.5 km
# model     18 km long, 2 km thick; three pushes, 5.5 km in all; crests eroded after each; after the first two the
#           foreland is filled; about 4500 spheres of radius 45 and 60 m at the end
# run       ./scripts/run examples/sedimentation_erosion.py       (under a minute on two cores)
# results   examples/data: a frame every 500 m of shortening and one after each deposit, walls.csv (the force on the
#           wall), a figure of the last frame
# -----------------------------------------------------------------------------
START
SET disk off                            # spheres: mass 4/3 pi r^3 x density
SET seed 5
SET gentry 2.75                         # attempts per requested particle

BOX left -100.0 right 18100.0 bottom -100.0 height 4800.0
WALL id 0 nodes (0.0, 0.0) (18000.0, 0.0)            color black
WALL id 1 nodes (0.0, 4600.0) (0.0, 0.0)             color blue
WALL id 2 nodes (18000.0, 0.0) (18000.0, 4600.0)     color red

# As many random particles as fit; then a flat top at 2 km.
GEN NUM 60000 rad discrete 45.0 60.0 x (0.0, 18000.0) y (0.0, 4600.0) group rock
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0
SET gravity 0.0 -9.8
SET dt 0.03
SET print 0
CYC 5000
DEL range y 2000.0 99999.0
CYC 1500

# The lowest 300 m are weak: no bonds, little friction. Above: bonded rock with marker beds of 300 m.
PROP color violet fric 0.05 group weak range y -100.0 300.0
PROP ebmod 2e8 gbmod 2e8 tstrength 1e7 sstrength 2e7 fric 0.3 range group rock
PROP color lg     range group rock
PROP color green  range y  600.0  900.0
PROP color mg     range y 1200.0 1500.0

WALL id 0 fric 0.05
WALL id 1 fric 0.1
WALL id 2 fric 0.1

# Push 1, then the wall stops: erosion down to 2.9 km, and deposits on the foreland, cut at 2.3 km
# and bonded weakly.
WALL id 1 xv 2.0
IMPLE wall id 1 xmove 2000.0 print 500.0
WALL id 1 xv 0.0
DEL range y 2900.0 99999.0
GEN NUM 20000 rad discrete 45.0 60.0 x (2000.0, 18000.0) y (2000.0, 3600.0) group deposit1
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.3 color yellow range group deposit1
CYC 2500
DEL range group deposit1 and y 2300.0 99999.0
CYC 500
PROP ebmod 2e8 gbmod 2e8 tstrength 2e6 sstrength 4e6 fric 0.3 range group deposit1

# Push 2, then the wall stops: the same, with the foreland filled to 2.6 km.
WALL id 1 xv 2.0
IMPLE wall id 1 xmove 1500.0 print 500.0
WALL id 1 xv 0.0
DEL range y 2900.0 99999.0
GEN NUM 20000 rad discrete 45.0 60.0 x (4000.0, 18000.0) y (2000.0, 3600.0) group deposit2
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.3 color gb range group deposit2
CYC 2500
DEL range group deposit2 and y 2600.0 99999.0
CYC 500
PROP ebmod 2e8 gbmod 2e8 tstrength 2e6 sstrength 4e6 fric 0.3 range group deposit2

# Push 3 and a last erosion
WALL id 1 xv 2.0
IMPLE wall id 1 xmove 2000.0 print 500.0
WALL id 1 xv 0.0
DEL range y 3200.0 99999.0
CYC 500
CYC 1                                   # writes a last frame at its start
STOP
