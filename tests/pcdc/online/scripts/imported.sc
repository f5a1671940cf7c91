# A mesh of another program, pulled.
pcdc model new
pcdc model import abaqus 'plate.inp'
pcdc model scale 2,1
pcdc e c-m mech-iso-e prop den 2500 y 1e9 p-r 0
pcdc n apply mech-vel-b-c v-y 0 range y 0
pcdc n apply mech-vel-b-c v-x 0 range x 0
pcdc e-f apply m-s-b-c xx 5e5 range x 4
pcdc model dyn off
pcdc model solve ratio 1e-9 cycle 20000
