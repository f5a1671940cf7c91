# A ring that is hot inside, in steady state.
pcdc model new
pcdc element create hollow-circle c (0,0) rad 2 m-s 0.25 i-rad 1 m-s 0.15
pcdc geometry create circle c (0,0) rad 1 as-layer 'in'
pcdc geometry create circle c (0,0) rad 2 as-layer 'out'
pcdc e c-m mech-iso-e prop den 2500 y 1e10 p-r 0.25
pcdc e c-m therm-iso-h prop con 2 cap 900 e-c 1e-5
pcdc n therm-init t 10
pcdc model mechanical off
pcdc n apply therm-n-b-c t 110 range geom-dis 'in' within 1e-6
pcdc n apply therm-s-b-c t 10 range geom-dis 'out' within 1e-6
pcdc model solve thermal steady
