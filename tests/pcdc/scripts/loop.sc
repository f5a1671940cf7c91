# A bar is pulled apart in a loop that looks at it; asks for its own end where a file `stop` lies.
import os
import signal
m_L, m_v = 0.04, 0.3
pcdc mesh structured (0,0) ([m_L],0.01) cells 8 2 diagonal alternate group 'bar' set 'domain'
pcdc element c-model mech-iso-e property den 2700 y 30e9 p-r 0.25 d-f 0.1
pcdc face-joint c-model c-i-c-i property f 30 c 20e6 t-s 2e6 gf1 1 gf2 10
pcdc model option energy on
pcdc node group 'right' set 'bc' range geometry 'right'
pcdc node boundary mech-vel-b-c velocity-x 0 range geometry 'left'
pcdc node boundary mech-vel-b-c velocity-x [m_v] range group 'right' set 'bc'
pcdc history create 'load' node value reaction-x sum every 7 range group 'right' set 'bc'
pcdc history create 'kinetic' model value kinetic-energy every 7
pcdc output vtk 'bar' every 100
seen = []
while len(seen) < 6:
    if len(seen) == 3 and os.path.exists('stop'):
        os.kill(os.getpid(), signal.SIGUSR1)
    pcdc model step 150
    seen.append((pcdc.time, pcdc.values('element', 'stress-xx').max(), pcdc.energies['closing']))
    print('step', pcdc.cycle, '%.17g %.17g' % seen[-1][:2])
pcdc model solve time [0.1 * seen[-1][0]]
pcdc model save 'end.sav'
m_last = pcdc.history('load')[-1][2]
print('last %.17g' % m_last)
