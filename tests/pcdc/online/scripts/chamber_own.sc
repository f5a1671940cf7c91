pcdc model new dim 3
pcdc mesh structured (0,0,0) (4,4,4) cells 4 4 4 type hex
pcdc element c-model mech-iso-elastic property density 2500 young 5e9 poisson-ratio 0.25
pcdc element initial stress-xx -3e4 stress-yy -3e4 stress-zz -98e3 gradient (0,0,24500)
pcdc model gravity (0,0,-9.8)
pcdc model option dynamic off
pcdc node boundary mech-m-b-c type 1 range x 0 0
pcdc node boundary mech-m-b-c type 1 range x 4 4
pcdc node boundary mech-m-b-c type 1 range y 0 0
pcdc node boundary mech-m-b-c type 1 range y 4 4
pcdc node boundary mech-m-b-c type 1 range z 0 0
pcdc element c-model null range x 1 3 y 1 3 z 1 3
pcdc model step 250
