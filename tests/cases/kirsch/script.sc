# A disk with a hole under far stress, calculated statically.
m_R, m_a = 20.0, 1.0
pcdc model new dim 2
pcdc geom create circle (0,0) [m_R] as-layer 'out'
pcdc geom create circle (0,0) [m_a] as-layer 'hole'
pcdc mesh create from-layer 'out' size [m_R/12] refine-layer 'hole' size [m_a/16] hole 'hole' group 'rock' set 'domain'
pcdc element c-model mech-iso-e property den 2500 y 50e9 p-r 0.25 d-f 1.0
pcdc element-face group 'rim' set 'bc' range geometry 'out'
pcdc element-face boundary m-s-b-c s-xx -20e6 s-yy -10e6 range group 'rim' set 'bc'
pcdc node boundary mech-m-b-c type 1 (0,0) range id 1
pcdc model option dynamic off
pcdc model option collision off
pcdc history create 'ratio' model value ratio every 100
pcdc model solve ratio 1e-6

# What the test compares with the exact solution.
with open('stress.txt', 'w') if pcdc.rank == 0 else open('/dev/null', 'w') as file:
    columns = [pcdc.values('element', name) for name in ('stress-xx', 'stress-yy', 'stress-xy', 'area')]
    columns += [pcdc.values('element', name) for name in ('element-position-x', 'element-position-y')]
    for row in zip(*columns):
        file.write(' '.join(repr(float(v)) for v in row) + '\n')
print('steps', pcdc.cycle)
pcdc model save 'kirsch.sav'
pcdc output vtk 'kirsch'
