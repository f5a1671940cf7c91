# A slope with a lake before it.
pcdc model new
foot = [(0,0), (30,0), (30,14), (18,14), (8,4), (0,4)]
pcdc geometry create polyline-close [foot] as-layer 'slope'
pcdc geometry create polyline (-5,9) (13,9) as-layer 'lake'
pcdc element create geometry layer 'slope' m-s 2.5
pcdc e c-m mech-m-c prop den 2000 y 1e8 p-r 0.3 fri 25 coh 2e4 ten 5e3
pcdc model gravity 0,-9.8
pcdc model dynamic off
pcdc node apply mech-vel-b-c v-x 0 range x 0
pcdc node apply mech-vel-b-c v-x 0 range x 30
pcdc node apply mech-m-b-c type 1 range y 0
pcdc e w s 'lake' d 1000 range y 2.5 14
pcdc model solve ratio 1e-4
