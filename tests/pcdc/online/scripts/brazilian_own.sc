pcdc model new
pcdc geometry create circle (0,0) 0.02 as-layer 'disc'
pcdc mesh create from-layer 'disc' size 0.004
pcdc element c-model mech-iso-elastic property density 2500 young 10e9 poisson-ratio 0.25 damp-factor 0.1
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 10e6 tensile-strength 2e6 gf1 4 gf2 40 penalty-normal 1e11 penalty-shear 1e11
pcdc node boundary mech-vel-b-c velocity-y -2 range y 0.0185 0.021
pcdc node boundary mech-vel-b-c velocity-y 2 range y -0.021 -0.0185
pcdc model step 900
