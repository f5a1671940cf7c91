pcdc model new
pcdc geometry create polygon (0,0) (20,0) (14,8) (6,8) as-layer 'dam'
pcdc mesh create from-layer 'dam' size 2
pcdc element c-model mech-iso-elastic property density 2200 young 1e9 poisson-ratio 0.25
pcdc face-joint c-model hydr-p-m property fluid-density 1000 fluid-bulk 2e8 viscosity 1e-6 aperature-initial 1e-3 aperature-minumum 1e-4 aperature-maximum 5e-3
pcdc geometry create polyline (0,0) (6,8) as-layer 'up'
pcdc geometry create polyline (20,0) (14,8) as-layer 'down'
pcdc model gravity (0,-9.8)
pcdc model option mechanical off
pcdc flow-node initial saturation 1
pcdc node boundary hydra-c-f-b flow-surface 6 range geometry 'up'
pcdc node boundary hydra-c-f-b flow-surface 1 range geometry 'down'
pcdc model step 400
