# Seepage through a jointed dam, in blocks that stand still.
pcdc model new
pcdc element create geometry-patch b-c-p array (0,0) (20,0) (14,8) (6,8) m-s 2
pcdc e c-m mech-iso-e prop den 2200 y 1e9 p-r 0.25
pcdc e c-m hydr-p-m prop f-den 1000 f-b 2e8 visc 1e-6 a-i 1e-3 a-min 1e-4 a-max 5e-3
pcdc geometry create polyline (0,0) (6,8) as-layer 'up'
pcdc geometry create polyline (20,0) (14,8) as-layer 'down'
pcdc model gravity 0,-9.8
pcdc model mechanical off
pcdc node hydr-init f-n-s 1
pcdc node apply hydra-c-f-b f-s (0,6) range geometry-distance 'up' within 0.01
pcdc node apply hydra-c-f-b f-s (0,1) range geometry-distance 'down' within 0.01
pcdc model solve cycle 400
