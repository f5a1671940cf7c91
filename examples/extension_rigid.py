# Extension over a rigid base: a graben above a velocity step, filled as it subsides
# -----------------------------------------------------------------------------
# shows     a graben 7 km wide between faults that dip towards each other: the left one, 61 degrees, is above the
#           step; the right one, 51 degrees, moves with the plate. The old surface subsided by 1.9 km between them, and
#           three fills of about 0.5 km thin towards the right
# model     16.5 km long, 3 km thick, on two rows of fixed particles: the lower one is pulled from under the upper
#           one; about 6900 spheres of radius 45 and 60 m at the end
# run       ./scripts/run examples/extension_rigid.py       (under a minute on two cores)
# results   examples/data: a frame every 500 m of extension and one after each filling, a figure of the last frame
# -----------------------------------------------------------------------------
START
SET disk off                            # spheres: mass 4/3 pi r^3 x density
SET seed 43
SET gentry 2.75                         # attempts per requested particle

BOX left -100.0 right 19600.0 bottom -300.0 height 6300.0
WALL id 1 nodes (0.0, 6000.0) (0.0, 0.0)             color blue
WALL id 2 nodes (16500.0, 0.0) (16500.0, 6000.0)     color red

# The base. "still" ends at x = 8 km: there the base has a velocity step, because "plate" below it will move.
GLINE p1 (0.0,    0.0) p2 ( 8000.0,    0.0) rad 50.0 group still color black
GLINE p1 (0.0, -100.0) p2 (16500.0, -100.0) rad 50.0 group plate color red
FIX x y spin                            # without RANGE: all particles, these two rows

# As many random particles as fit; then a flat top at 3 km.
GEN NUM 60000 rad discrete 45.0 60.0 x (0.0, 16500.0) y (0.0, 6000.0) group cover
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0
SET gravity 0.0 -9.8
SET dt 0.03
SET print 0
CYC 6000
DEL range y 3000.0 99999.0
CYC 2000

# A rough base, and a brittle cover: weak bonds, high friction where they broke.
PROP fric 0.4 range group still and group plate      # each particle is in one group: this means both
PROP ebmod 2e8 gbmod 2e8 tstrength 3e6 sstrength 6e6 fric 0.5 range group cover

# Marker beds of 300 m.
PROP color lg     range group cover
PROP color green  range y  600.0  900.0 and group cover
PROP color mg     range y 1200.0 1500.0
PROP color mg     range y 1800.0 2100.0
PROP color mg     range y 2400.0 2700.0

# The first km of extension at 2 m/s, then rest and a first filling of the graben: new particles, cut at the height of
# the shoulders.
PROP xv 2.0 range group plate
WALL id 2 xv 2.0
IMPLE wall id 2 xmove 1000.0 print 500.0
PROP xv 0.0 range group plate
WALL id 2 xv 0.0
GEN NUM 20000 rad discrete 45.0 60.0 x (6000.0, 14500.0) y (1500.0, 4700.0) group fill1
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.3 color yellow range group fill1
CYC 2500
DEL range group fill1 and y 2950.0 99999.0
CYC 500

# The second km of extension at 2 m/s, then rest and filling.
PROP xv 2.0 range group plate
WALL id 2 xv 2.0
IMPLE wall id 2 xmove 1000.0 print 500.0
PROP xv 0.0 range group plate
WALL id 2 xv 0.0
GEN NUM 20000 rad discrete 45.0 60.0 x (6000.0, 14500.0) y (1500.0, 4700.0) group fill2
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.3 color red range group fill2
CYC 2500
DEL range group fill2 and y 2950.0 99999.0
CYC 500

# The third km of extension at 2 m/s, then rest and filling.
PROP xv 2.0 range group plate
WALL id 2 xv 2.0
IMPLE wall id 2 xmove 1000.0 print 500.0
PROP xv 0.0 range group plate
WALL id 2 xv 0.0
GEN NUM 20000 rad discrete 45.0 60.0 x (6000.0, 14500.0) y (1500.0, 4700.0) group fill3
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.3 color gb range group fill3
CYC 2500
DEL range group fill3 and y 2950.0 99999.0
CYC 500

CYC 1                                   # writes a last frame at its start
STOP
