# A plate is torn in two; asks for a checkpoint while joints break, where a file `stop` lies.
import os
import signal
pcdc mesh structured (0,0) (0.4,0.2) cells 16 8 diagonal alternate group 'plate' set 'domain'
pcdc element c-model mech-iso-e property den 2700 y 20e9 p-r 0.2 d-f 0.1
pcdc face-joint c-model c-i-c-i property f 20 c 2e6 t-s 1e6 gf1 1 gf2 3
pcdc node group 'right' set 'bc' range geometry 'right'
pcdc node boundary mech-vel-b-c velocity-x 0 velocity-y 0 range geometry 'left'
pcdc node boundary mech-vel-b-c velocity-x 0.12 velocity-y 0.05 range group 'right' set 'bc'
pcdc history create 'load' node value reaction-x sum range group 'right' set 'bc'
pcdc history create 'highest' node value reaction-x maximum every 3 range group 'right' set 'bc'
pcdc history create 'gauge' element nearest (0.2,0.1) value stress-xx
pcdc history create 'way' node value displacement-x mean every 10 range group 'right' set 'bc'
pcdc history create 'joint' joint nearest (0.2,0.1) value opening every 2
pcdc history create 'balance' model value ratio every 40
pcdc output vtk 'plate' every 200
pcdc model step 170
if os.path.exists('stop'):
    os.kill(os.getpid(), signal.SIGUSR1)
pcdc model step 563
pcdc element c-model null range id 5
pcdc model step 67
