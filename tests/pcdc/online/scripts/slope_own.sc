pcdc model new
pcdc geometry create polygon (0,0) (30,0) (30,14) (18,14) (8,4) (0,4) as-layer 'slope'
pcdc geometry create polyline (-5,9) (13,9) as-layer 'lake'
pcdc mesh create from-layer 'slope' size 2.5
pcdc element c-model mech-m-c property density 2000 young 1e8 poisson-ratio 0.3 friction 25 cohesion 2e4 tensile 5e3
pcdc model gravity (0,-9.8)
pcdc model option dynamic off
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 range x 30 30
pcdc node boundary mech-m-b-c type 1 range y 0 0
pcdc element water surface 'lake' density 1000 range y 2.5 14
pcdc model solve ratio 1e-4
