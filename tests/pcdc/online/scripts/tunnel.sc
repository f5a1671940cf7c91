# A tunnel in two stages, with bolts and supports.
pcdc model new
pcdc element create brick p0 (-6,-6) p1 (6,-6) p2 (-6,6) n 12 12 tri false
pcdc geometry create polyline-close (-2,-1) (2,-1) (2,2) (-2,2) as-layer 'heading'
pcdc e c-m mech-iso-e prop den 2500 y 5e9 p-r 0.25
pcdc e init s-xx -4e6 s-yy -8e6
pcdc model dynamic off
pcdc n apply mech-m-b-c type 1 range not y -5.5 5.5
pcdc n apply mech-m-b-c type 1 range not x -5.5 5.5
pcdc e c-m null range geom-loc 'heading' ray-dir (0,1) count 1 x -2 0
pcdc model solve cycle 300
pcdc bolt-element create (-1.5,2.2) (-1.5,4.6) m-s 0.5
pcdc bolt-element create (-0.5,2.2) (-0.5,4.6) m-s 0.5
pcdc support-element create (-4.6,0.5) (-2.2,0.5) m-s 0.5
pcdc bolt-element c-model mech-e-p prop den 7800 y 2e11 d 0.025 s-s-r-b 1e9 t-y-f 2.5e5 g-t 0.01 c-r-g 1e6 c-g-b 2e6 spac 1
pcdc e delete range geom-loc 'heading' ray-dir (0,1) count 1 x 0 2
pcdc model solve cycle 600
