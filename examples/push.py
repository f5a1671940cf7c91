# Thrust wedge: a wall pushes a layered, cohesive sequence over a rough floor
# -----------------------------------------------------------------------------
# shows     forethrusts that start at the wall and step forward, one in front
#           of the other, while the wedge behind them thickens
# model     25 km long, 3 km thick, about 4800 spheres of radius 60 and 80 m
# run       ./scripts/run examples/push.py       (under a minute on two cores)
# results   examples/data: a frame per kilometre of shortening, walls.csv (the
#           force on the wall), checkpoints, a figure of the last frame
# -----------------------------------------------------------------------------
START
SET disk off                            # spheres: mass 4/3 pi r^3 x density
SET seed 20

# The space in which particles may be; the model stands a little inside it.
BOX left 0.0 right 26000.0 bottom 0.0 height 9000.0

# Floor, moving wall, far wall. Particles of the Hertz law bring their own
# stiffness, so walls need none.
WALL id 0 nodes (0.0, 500.0) (25500.0, 500.0)        color black
WALL id 1 nodes (500.0, 8500.0) (500.0, 500.0)       color blue
WALL id 2 nodes (25500.0, 500.0) (25500.0, 8500.0)   color red

# Loose rain of particles; far more are asked for than fit, so the space fills up.
GEN num 60000 rad discrete 60.0 80.0 x (500.0, 25500.0) y (500.0, 8000.0) group rock
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0

SET gravity 0.0 -9.8
SET dt 0.05
SET print 0                             # frames only during the push

CYC 4000                                # settle under gravity
DEL range y 3500.0 99999.0              # a flat top at 3 km
CYC 1500                                # and rest

# Rock: elastic bonds with a tensile strength and a cohesion, and friction.
PROP ebmod 2e8 gbmod 2e8 tstrength 2e7 sstrength 4e7 fric 0.3

# Marker beds of 500 m.
PROP color lg     range y  400.0 1000.0
PROP color yellow range y 1000.0 1500.0
PROP color green  range y 1500.0 2000.0
PROP color white  range y 2000.0 2500.0
PROP color red    range y 2500.0 3000.0
PROP color gb     range y 3000.0 4000.0

# A rough floor and rough walls, then the push: 6 km at 2 m/s.
WALL id 0 fric 0.3
WALL id 1 fric 0.3 xv 2.0
WALL id 2 fric 0.3
IMPLE wall id 1 xmove 6000.0 print 1000.0 save 3000.0
STOP
