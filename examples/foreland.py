# A thrust wedge on a base that bends: foreland basin and forebulge
# -----------------------------------------------------------------------------
# shows     sand that a wall pushes over an elastic plate, which is broken below the wall as at the edge of a mountain
#           belt: the wedge and the weight of the belt behind the wall bend it to a foreland basin with a forebulge
# model     60 km long, 2.5 km of sand in three layers, about 1500 discs; 6 km of shortening; flexural parameter 13.6 km;
#           the weight of the sand before is compensated; the belt behind the wall is a line load of 2.5e11 N/m
# run       ./scripts/run examples/foreland.py       (a minute on two cores)
# results   examples/data: flexure.csv, the deflection, load and bending moment along the plate; hist_1.csv, the largest
#           deflection; frames
# -----------------------------------------------------------------------------
START
SET disk on
BOX left -2000.0 right 64000.0 bottom -6000.0 height 24000.0
WALL id 1, NODES (1000.0, 15000.0) (1000.0, -5000.0), kn=4e9 ks=4e9 fric 0.2 COLOR blue
WALL id 2, NODES (60000.0, -5000.0) (60000.0, 15000.0), kn=4e9 ks=4e9 fric 0.0
WALL id 5, NODES (0.0, 0.0) (61000.0, 0.0), kn=4e9 ks=4e9 fric 0.1
SET gravity 0.0 -9.8
SET frac 0.15
GEN NUM 1500 rad discrete 150.0 175.0 200.0, x (1000.0, 60000.0), y (0.0, 6000.0), color yellow group sand
PROP density 2500.0, kn 4e9 ks 2e9 fric 0.0 damp 0.5
CYC 4000
PROP fric 0.4
PROP color green RANGE y 800.0 1600.0
PROP color red RANGE y 1600.0 2400.0
FLEXURE wall id 5 young 7e10 poisson 0.25 te 3500.0 contrast 3200.0 left broken load (1000.0 2.5e11) compensated interval 200
HIST ID 1 INTERVAL 200 , deflection
CYC 3000
WALL id 1 xv 6.0
IMPLE wall id 1 xmove 6000.0 print 3000.0
STOP
