# model: {"cut": 6, "files": {}}
START
SET gravity 0 -9.8 dt 1e-3
BOX left 0 right 30 bottom 0 height 20 kn 1e7 ks 1e7
GEN grid rad discrete 1.0 x (0 30) y (0 6)
PROP density 2500 kn 1e7 ks 1e7 fric 0.2
CYC 0
PROP yv -1.0
SET dt 2e-3
CYC 20
SAV end.sav
