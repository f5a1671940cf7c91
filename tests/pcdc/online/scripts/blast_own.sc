pcdc model new
pcdc geometry create polygon (0.4,0) (0.2,0.35) (-0.2,0.35) (-0.4,0) (-0.2,-0.35) (0.2,-0.35) as-layer 'hole'
pcdc geometry create rectangle (-4,-4) (4,4) as-layer 'rim'
pcdc mesh create from-layer 'rim' size 0.7 hole 'hole' refine-layer 'hole' size 0.2
pcdc element c-model mech-iso-elastic property density 2600 young 3e10 poisson-ratio 0.25
pcdc table create 'blast' values (0,0) (2e-4,-3e7) (8e-4,0)
pcdc element-face boundary m-s-b-c stress-normal table 'blast' range geometry 'hole'
pcdc element-face boundary m-s-b-c quiet on range x -4 -4 boundary
pcdc element-face boundary m-s-b-c quiet on range x 4 4 boundary
pcdc element-face boundary m-s-b-c quiet on range y -4 -4 boundary
pcdc element-face boundary m-s-b-c quiet on range y 4 4 boundary
pcdc model solve time 4e-3
