# A jointed specimen between moved ends, until it breaks.
pcdc model new
pcdc element create brick p0 (0,0) p1 (0.05,0) p2 (0,0.1) n 6,12
pcdc e c-m mech-iso-e prop den 2500 y 20e9 p-r 0.2 d-f 0.1
pcdc f-j c-m c-i-c-i prop f 30 c 8e6 t-s 3e6 gf1 10 ...
gf2 60 p-n 2e11 p-s 2e11
pcdc e-f c-m c-m-c prop f 25 n-s 2e11 s-s 1e11
pcdc node boundary apply mech-vel-b-c v-y 2 range y 0
pcdc node boundary apply mech-vel-b-c v-y -2 range y 0.1
pcdc model dynamic true
pcdc model solve cycle 2000
