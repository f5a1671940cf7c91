import math
# A bar is pulled apart: joints break in the middle.
m_L, m_v = 0.04, 0.15
pcdc model new
pcdc mesh structured (0,0) ([m_L],0.01) cells 12 3 diagonal alternate group 'bar' set 'domain'
pcdc element c-model mech-iso-e property den 2700 y 30e9 p-r 0.25 d-f 0.1
pcdc face-joint c-model c-i-c-i property f 30 c 20e6 t-s 2e6 gf1 1 gf2 10
pcdc node group 'left' set 'bc' range geometry 'left'
pcdc node group 'right' set 'bc' range geometry 'right'
pcdc table create 'pull' values (0,0) (2e-6,[m_v])
pcdc node boundary mech-vel-b-c velocity-x 0 range group 'left' set 'bc'
pcdc node boundary mech-vel-b-c velocity-x table 'pull' range group 'right' set 'bc'
pcdc history create 'load' node value reaction-x sum every 5 range group 'right' set 'bc'
pcdc history create 'way' node value displacement-x mean every 5 range group 'right' set 'bc'
pcdc history create 'broken' model value broken-joints every 5
pcdc history create 'point' joint value normal-stress-largest max every 5 range face-of 'bar' set 'domain'
pcdc output vtk 'bar' every 100
def m_report(what):
    print(what, pcdc.cycle, '%.4g' % pcdc.time, pcdc.history('broken')[-1][2])
pcdc model solve time 2e-5
m_report('first')
pcdc model save 'half.sav'
pcdc model solve time 2e-5
m_report('second')
pcdc model save 'end.sav'
pcdc chart create 'pull' x-label 'displacement [[um]]' y-label 'stress [[MPa]]'
pcdc chart add 'pull' x 'way' scale-x 1e6 y 'load' scale-y 1e-4 label 'model'
pcdc chart export 'pull' 'pull.png'
