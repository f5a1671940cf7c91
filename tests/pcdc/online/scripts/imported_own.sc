pcdc model new
pcdc mesh import 'plate.inp'
pcdc model scale (2,1)
pcdc element c-model mech-iso-elastic property density 2500 young 1e9 poisson-ratio 0
pcdc node boundary mech-vel-b-c velocity-y 0 range y 0 0
pcdc node boundary mech-vel-b-c velocity-x 0 range x 0 0
pcdc element-face boundary m-s-b-c stress-xx 5e5 range x 4 4
pcdc model option dynamic off
pcdc model solve ratio 1e-9 cycles 20000
