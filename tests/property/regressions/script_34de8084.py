# model: {"cut": 9, "files": {}}
START
SET outdir results
SET disk on
SET gravity 0 -0.3978874
SET dt 0.007089815
BOX left -2 right 18 bottom -2 height 24
WALL id 1 nodes (0, 16) (0, 0), kn=1000000 ks=500000 fric 0.0
WALL id 2 nodes (16, 0) (16, 16), kn=1000000 ks=500000 fric 0.0
HIST id 2 interval 5, step
GEN num 5, rad discrete 1, x (0, 16), y (0, 5.6)
PROP density 2500 kn=1000000 ks=500000 fric 0.0 damp 0.0
CYC 10
SAV end.sav
