# model: {}
START
SET disk on
SET gravity 0 -0.3978874
SET dt 0.007089815
SET seed 37
GEN num 5, rad discrete 1, x (0, 16), y (0, 8.4)
GEN num 5, rad discrete 1, x (0, 16), y (0, 8.4)
GEN grid rad discrete 1 x (0, 4.8) y (0, 4.8) group bed
PROP density 2500 kn=1000000 ks=500000 fric 0.3 damp 0.0
CYC 18
SAV end.sav
