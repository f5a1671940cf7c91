# A chamber is dug in a cube.
pcdc model new dim 3
pcdc element create brick p0 (0,0,0) p1 (4,0,0) p2 (0,4,0) p3 (0,0,4) n 4 4 4 triangle false
pcdc e c-m mech-iso-e prop den 2500 y 5e9 p-r 0.25
pcdc e init s-xx -3e4 s-yy -3e4 s-zz -98e3 gradient (0,0,24500)
pcdc model gravity 0,0,-9.8
pcdc model dynamic off
pcdc n apply mech-m-b-c type 1 range not x 0.1 3.9
pcdc n apply mech-m-b-c type 1 range not y 0.1 3.9
pcdc n apply mech-m-b-c type 1 range z 0
pcdc e delete range x 1 3 y 1 3 z 1 3
pcdc model solve cycle 250
