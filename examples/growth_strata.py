# Growth strata: a thrust belt that is buried by sediment while it grows, and eroded where it rises above it
# -----------------------------------------------------------------------------
# shows     growth strata that thin towards the rising folds, onlap them and are cut by younger thrusts; crests that are
#           worn down by diffusion and slope failure
# model     20 km long, 1.8 km thick; a wall pushes 5 km, while sediment fills the basins up to a level that rises by
#           1.2 km; six groups of strata; about 5400 spheres of radius 45 and 60 m at the end
# run       ./scripts/run examples/growth_strata.py       (about a minute on two cores)
# results   examples/data: a frame every 500 m of shortening, surface.csv (areas eroded and deposited), walls.csv (the
#           force on the wall), a figure of the last frame; the balance of the surface process in the log
# -----------------------------------------------------------------------------
START
SET disk off                            # spheres: mass 4/3 pi r^3 x density
SET seed 20
SET gentry 2.75                         # attempts per requested particle

BOX left -100.0 right 20100.0 bottom -100.0 height 7000.0
WALL id 0 nodes (0.0, 0.0) (20000.0, 0.0)            color black
WALL id 1 nodes (0.0, 6800.0) (0.0, 0.0)             color blue
WALL id 2 nodes (20000.0, 0.0) (20000.0, 6800.0)     color red

GEN num 60000 rad discrete 45.0 60.0 x (0.0, 20000.0) y (0.0, 4600.0) group rock
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0
SET gravity 0.0 -9.8
SET dt 0.03
SET print 0
CYC 5000                                # settle under gravity
DEL range y 1800.0 99999.0              # a flat top
CYC 1500                                # and rest

# The lowest 300 m are weak. Above: bonded rock with marker beds.
PROP fric 0.05 color violet group weak range y -100.0 300.0
PROP ebmod 2e8 gbmod 2e8 tstrength 1e7 sstrength 2e7 fric 0.3 range group rock
PROP color lg     range group rock
PROP color mg     range y  600.0  900.0
PROP color mg     range y 1200.0 1500.0

# Every 200 steps (6 s): sediment up to a level that rises by 0.48 m/s, diffusion of the surface, no slope above 32
# degrees. A new group every 14000 steps (840 m of shortening).
SURFACE id 1 interval 200 x (0.0, 20000.0) below 1800.0 rise 0.48 diffuse 250.0 slope 32.0 rad discrete 45.0 60.0 density 2300.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.3 group growth episode 14000 colors yellow|gb|green|red|blue|black

WALL id 0 fric 0.05
WALL id 1 fric 0.1 xv 2.0
WALL id 2 fric 0.1
IMPLE wall id 1 xmove 5000.0 print 500.0
STOP
