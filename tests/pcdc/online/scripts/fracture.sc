# Water is pumped into the middle of a jointed plate that is pressed.
pcdc model new
pcdc element create brick p0 (-1,-1) p1 (1,-1) p2 (-1,1) n 8,8
pcdc e c-m mech-iso-e prop den 2500 y 1e10 p-r 0.2 d-f 0.3
pcdc f-j c-m c-i-c-i prop f 30 c 3e6 t-s 5e5 gf1 2 gf2 30 p-n 1e11 p-s 1e11
pcdc f-j c-m hydr-p-m prop f-den 1000 f-b 5e7 visc 1e-6 a-i 5e-4 a-min 1e-5 a-max 5e-3
pcdc e-f apply m-s-b-c s-xx -1e5 yy -2e5 range boundary
pcdc node hydr-init f-n-s 1
pcdc node apply hydra-c-f-b flow-rate 0.2 range x 0 y 0
pcdc model solve cycle 1500
