pcdc model new
pcdc mesh structured (0,0) (0.05,0.1) cells 6 12
pcdc element c-model mech-iso-elastic property density 2500 young 20e9 poisson-ratio 0.2 damp-factor 0.1
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 8e6 tensile-strength 3e6 gf1 10 gf2 60 penalty-normal 2e11 penalty-shear 2e11
pcdc element-face c-model contact-m-c property friction 25 penalty-normal 2e11 penalty-shear 1e11
pcdc node boundary mech-vel-b-c velocity-y 2 range y 0 0
pcdc node boundary mech-vel-b-c velocity-y -2 range y 0.1 0.1
pcdc model option dynamic on
pcdc model step 2000
