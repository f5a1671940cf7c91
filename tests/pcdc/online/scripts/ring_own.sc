pcdc model new
pcdc geometry create circle (0,0) 1 as-layer 'in'
pcdc geometry create circle (0,0) 2 as-layer 'out'
pcdc mesh create from-layer 'out' size 0.25 hole 'in' refine-layer 'in' size 0.15
pcdc element c-model mech-iso-elastic property density 2500 young 1e10 poisson-ratio 0.25
pcdc element c-model therm-iso-h property conductivity 2 capacity 900 expansion-coeficient 1e-5
pcdc node initial temperature 10
pcdc model option mechanical off
pcdc node boundary therm-s-b-c temperature 110 range geometry 'in'
pcdc node boundary therm-s-b-c temperature 10 range geometry 'out'
pcdc model solve thermal steady
