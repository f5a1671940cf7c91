# A blast in a hole, quiet faces around.
pcdc model new
hole = [(0.4,0), (0.2,0.35), (-0.2,0.35), (-0.4,0), (-0.2,-0.35), (0.2,-0.35)]
pcdc element create geometry-boundary boundary (-4,-4) (4,-4) (4,4) (-4,4) m-s 0.7 inner-boundary [hole] m-s 0.2
pcdc geometry create polyline-close [hole] as-layer 'hole'
pcdc e c-m mech-iso-e prop den 2600 y 3e10 p-r 0.25
pcdc table 'blast' data 0 0, 2e-4 -3e7, 8e-4 0
pcdc e-f apply mech-s-b-c s-n table 'blast' range geometry-distance 'hole' within 1e-6 boundary
pcdc e-f apply mech-abs-b-c range boundary not x -3.9 3.9
pcdc e-f apply mech-abs-b-c range boundary not y -3.9 3.9
pcdc model solve time 4e-3
