# Brazilian test: a disc of rock, 50 mm wide and 20 mm thick, is compressed between two strips until it splits, in three
# dimensions: tetrahedra with a joint on every inner face. The crack runs through the middle, between wedges of crushed
# rock under the strips. 2 P / (pi D t) at the peak is the indirect tensile strength. It exceeds that of the joints
# (5 MPa), because the crack follows a rough path along faces. A minute on one core.
# Needs the extra [mesh].
#
#   hpcdem brazilian_disc.sc      data/split_<step>.png: the halves; brazilian_disc.png: force over shortening
import math

import numpy as np

radius, thickness, speed, strength = 0.025, 0.02, 0.4, 5e6

pcdc model new dim 3
pcdc geometry create cylinder (0,0,0) (0,0,[thickness]) [radius] as-layer 'disc'
pcdc mesh create from-layer 'disc' size 0.0033
pcdc element c-model mech-iso-e property density 2600 young 40e9 poisson-ratio 0.22 friction 30
pcdc face-joint c-model c-i-c-i property friction 35 cohesion 20e6 tensile-strength [strength] gf1 5 gf2 50 penalty-normal 1.2e12
pcdc node group 'top' range x -0.0035 0.0035 y 0.0244 0.026
pcdc node group 'bottom' range x -0.0035 0.0035 y -0.026 -0.0244
pcdc node boundary mech-vel-b-c velocity-y [-speed] range group 'top'
pcdc node boundary mech-vel-b-c velocity-y [speed] range group 'bottom'
pcdc history create 'force' node value reaction-y sum every 20 range group 'top'
pcdc output vtk 'disc' every 1000
pcdc model step 6500
pcdc output image 'split' field 'displacement' limits 0 1e-4 deformed 10 eye '0.5,0.4,1'

force = pcdc.history('force')
peak = np.abs(force[:, 2]).max()
x, area, state = (pcdc.values('joint', name) for name in ('joint-position-x', 'joint-area', 'state'))
broken = state == 3
print('indirect tensile strength %.2f MPa, that of the joints %.2f MPa; %d joints broke, %.0f %% of their area within D / 7 of the middle' % (
    1e-6 * 2 * peak / (math.pi * 2 * radius * thickness), 1e-6 * strength, broken.sum(),
    100 * area[broken & (np.abs(x) < radius / 7)].sum() / area[broken].sum()))

if pcdc.rank == 0:
    import matplotlib
    matplotlib.use('agg')
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(figsize=(5.2, 3.6), layout='constrained')
    axes.plot(2e6 * speed * force[:, 1], 1e-3 * np.abs(force[:, 2]), color='#2f6f9f')
    axes.axhline(1e-3 * strength * math.pi * radius * thickness, color='0.4', lw=0.8, ls='--')
    axes.text(0, 1e-3 * strength * math.pi * radius * thickness, ' strength of the joints', va='bottom', color='0.4')
    axes.set(xlabel='shortening [µm]', ylabel='force [kN]', xlim=(0, None), ylim=(0, None))
    figure.savefig('brazilian_disc.png', dpi=160)
