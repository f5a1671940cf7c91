# A disc that is split by two narrow ends.
pcdc model new
pcdc element create geometry circle c (0,0) rad 0.02 m-s 0.004 is-bound
pcdc e c-m mech-iso-e prop den 2500 y 10e9 p-r 0.25 d-f 0.1
pcdc f-j c-m c-i-c-i prop f 30 c 10e6 t-s 2e6 gf1 4 gf2 40 p-n 1e11 p-s 1e11
pcdc node bou apply mech-vel-b-c v-y -2 range y 0.0185 0.021
pcdc node bou apply mech-vel-b-c v-y 2 range y -0.021 -0.0185
pcdc model solve cycle 900
