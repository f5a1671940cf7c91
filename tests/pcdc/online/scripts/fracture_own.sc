pcdc model new
pcdc mesh structured (-1,-1) (1,1) cells 8 8
pcdc element c-model mech-iso-elastic property density 2500 young 1e10 poisson-ratio 0.2 damp-factor 0.3
pcdc face-joint c-model c-i-c-i property friction 30 cohesion 3e6 tensile-strength 5e5 gf1 2 gf2 30 penalty-normal 1e11 penalty-shear 1e11
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 5e7 viscosity 1e-6 aperature-initial 5e-4 aperature-minumum 1e-5 aperature-maximum 5e-3
pcdc element-face boundary m-s-b-c stress-xx -1e5 stress-yy -2e5 range boundary
pcdc flow-node initial saturation 1
pcdc node boundary hydra-c-f-b flow-rate 0.2 range x 0 0 y 0 0
pcdc model step 1500
