# A tunnel of 3 m radius is driven 30 m into rock under 10 MPa from all sides: how much does its wall close ahead of and
# behind the face? Three dimensions, a quarter of the tunnel by symmetry. Far behind the face the wall closes by
# (1 + nu) p r / E = 3.75 mm (0.945 of it here: the box is fixed at ten radii, and tetrahedra are stiff), at the face by
# 0.29 of the value far behind (Vlachopoulos & Diederichs 2009; 0.26 here). A few seconds on one core.
# Needs the extra [mesh].
#
#   hpcdem tunnel_face.sc      tunnel_face.png: closure along the tunnel; data/closure_<step>.png: the rock
import numpy as np

radius, face, pressure, young, poisson = 3.0, 30.0, 10e6, 10e9, 0.25

pcdc model new dim 3
pcdc model option collision off dynamic off
pcdc geometry create box (0,0,0) (30,60,30) as-layer 'rock'
pcdc geometry create cylinder (0,0,0) (0,[face],0) [radius] as-layer 'tunnel'
pcdc mesh create from-layer 'rock' size 5 refine-layer 'tunnel' size 0.5 distance 20 region 'tunnel' group 'tunnel'
pcdc element c-model mech-iso-e property density 2500 young [young] poisson-ratio [poisson]
pcdc element initial stress-xx [-pressure] stress-yy [-pressure] stress-zz [-pressure]
pcdc node boundary mech-vel-b-c velocity-x 0 range x -0.001 0.001
pcdc node boundary mech-vel-b-c velocity-x 0 range x 29.999 30.001
pcdc node boundary mech-vel-b-c velocity-y 0 range y -0.001 0.001
pcdc node boundary mech-vel-b-c velocity-y 0 range y 59.999 60.001
pcdc node boundary mech-vel-b-c velocity-z 0 range z -0.001 0.001
pcdc node boundary mech-vel-b-c velocity-z 0 range z 29.999 30.001
pcdc element c-model null range group 'tunnel'
pcdc model solve ratio 1e-5
pcdc output image 'closure' field 'displacement' eye '-1,-1,0.7'

x, y, z = (pcdc.values('node', 'position-' + axis) for axis in 'xyz')
dx, dz = (pcdc.values('node', 'displacement-' + axis) for axis in 'xz')
r = np.hypot(x - dx, z - dz)
wall = np.abs(r - radius) < np.where(y > face + 0.01, 0.1, 0.01) * radius
closure = -(dx * (x - dx) + dz * (z - dz))[wall] / r[wall]
along = (y[wall] - face) / radius
behind = closure[along < -6].mean()
print('far behind the face the wall has closed by %.2f mm, in theory %.2f mm; at the face by %.2f of that' % (
    1e3 * behind, 1e3 * (1 + poisson) * pressure * radius / young, closure[np.abs(along) < 0.05].mean() / behind))

if pcdc.rank == 0:
    import matplotlib
    matplotlib.use('agg')
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(figsize=(6.7, 3.9), layout='constrained')
    s = np.linspace(-5, 5, 201)
    known = np.where(s > 0, 0.287 * np.exp(-np.abs(s)), 1 - (1 - 0.287) * np.exp(-1.5 * np.abs(s)))
    axes.plot(along, closure / behind, 'o', ms=3, mfc='none', color='#2f6f9f', label='nodes at the radius of the tunnel')
    axes.plot(s, known, 'k', lw=1.2, label='Vlachopoulos & Diederichs 2009')
    axes.axvline(0, color='0.6', lw=0.8)
    axes.text(-0.1, 1.06, 'driven', ha='right')
    axes.text(0.1, 1.06, 'rock ahead')
    axes.set(xlim=(-5, 5), ylim=(0, 1.15), xlabel='distance from the face / radius', ylabel='closure / closure far behind')
    axes.legend(loc='lower left', frameon=False)
    figure.savefig('tunnel_face.png', dpi=160)
