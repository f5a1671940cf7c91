pcdc model new
pcdc mesh structured (-6,-6) (6,6) cells 12 12 type quad
pcdc geometry create polygon (-2,-1) (2,-1) (2,2) (-2,2) as-layer 'heading'
pcdc element group 'left' set 's' range geometry 'heading' x -2 0
pcdc element group 'right' set 's' range geometry 'heading' x 0 2
pcdc element c-model mech-iso-elastic property density 2500 young 5e9 poisson-ratio 0.25
pcdc element initial stress-xx -4e6 stress-yy -8e6
pcdc model option dynamic off
pcdc node boundary mech-m-b-c type 1 range y -6 -6
pcdc node boundary mech-m-b-c type 1 range y 6 6
pcdc node boundary mech-m-b-c type 1 range x -6 -6
pcdc node boundary mech-m-b-c type 1 range x 6 6
pcdc element c-model null range group 'left' set 's'
pcdc model step 300
pcdc bolt create polyline (-1.5,2.2) (-1.5,4.6) length 0.5
pcdc bolt create polyline (-0.5,2.2) (-0.5,4.6) length 0.5
pcdc bolt create polyline (-4.6,0.5) (-2.2,0.5) length 0.5
pcdc bolt c-model mech-e-p property density 7800 young 2e11 diameter 0.025 shear-stiffness-rock-bolt 1e9 tensile-yield-force 2.5e5 grout-thickness 0.01 cohesion-rock-grout 1e6 cohesion-grout-bolt 2e6 spacing 1
pcdc element c-model null range group 'right' set 's'
pcdc model step 600
