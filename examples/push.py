# Thrust sheets: a wall pushes bonded beds over a weak, loose layer
# -----------------------------------------------------------------------------
# shows     two thrust sheets in sequence, the first at the wall, the second
#           6 km in front of it, with beds folded over both ramps
# model     20 km long, 2.4 km thick, about 5600 spheres of radius 45 and 60 m
# run       ./scripts/run examples/push.py       (under a minute on two cores)
# results   examples/data: a frame every 1.5 km of shortening, walls.csv (the
#           force on the wall), checkpoints, a figure of the last frame
# -----------------------------------------------------------------------------
START
SET disk off                            # spheres: mass 4/3 pi r^3 x density
SET seed 20
SET gentry 2.75                         # attempts per requested particle

# The space for particles, slightly wider than the model.
BOX left -100.0 right 20100.0 bottom -100.0 height 6000.0

# Floor, moving wall, far wall. Hertz particles have their own stiffness, so
# walls need none.
WALL id 0 nodes (0.0, 0.0) (20000.0, 0.0)            color black
WALL id 1 nodes (0.0, 5800.0) (0.0, 0.0)             color blue
WALL id 2 nodes (20000.0, 0.0) (20000.0, 5800.0)     color red

# Loose random particles; far more are requested than fit, so the space is filled.
GEN num 60000 rad discrete 45.0 60.0 x (0.0, 20000.0) y (0.0, 5800.0) group rock
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0

SET gravity 0.0 -9.8
SET dt 0.03
SET print 0                             # frames only during the push

CYC 6000                                # settle under gravity
DEL range y 2400.0 99999.0              # a flat top
CYC 2000                                # and rest

# The lowest 300 m: no bonds, little friction. Above: rock, held by elastic
# bonds with a tensile strength and a cohesion, and friction where they broke.
PROP fric 0.1 group weak range y -100.0 300.0
PROP ebmod 2e8 gbmod 2e8 tstrength 1e7 sstrength 2e7 fric 0.3 range group rock

# Marker beds of 300 m.
PROP color mg     range group weak
PROP color yellow range y  300.0  600.0
PROP color lg     range y  600.0  900.0
PROP color green  range y  900.0 1200.0
PROP color lg     range y 1200.0 1500.0
PROP color red    range y 1500.0 1800.0
PROP color lg     range y 1800.0 2100.0
PROP color gb     range y 2100.0 9999.0

# Friction on floor and walls, then the push: 6 km at 2 m/s.
WALL id 0 fric 0.1
WALL id 1 fric 0.1 xv 2.0
WALL id 2 fric 0.1
IMPLE wall id 1 xmove 6000.0 print 1500.0 save 3000.0
STOP
