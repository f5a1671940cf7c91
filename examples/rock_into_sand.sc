# A jointed boulder falls into a bed of sand: particles and blocks in one run.
#
# The sand settles first; then the boulder is made of elements with cohesive joints, and from hpcdem.couple on
# `pcdc model step` steps both. About a minute on one core.
#
#   hpcdem rock_into_sand.sc          frames of the boulder in data/, of the sand in sand/
import hpcdem

width, radius, drop = 2.4, 0.025, 6.0                 # of the box, of the largest grain [m]; speed of the boulder [m/s]

sand = hpcdem.Simulation(outdir='sand')
sand.set(disk='on', gravity=(0.0, -9.81), dt=2e-5, seed=1)
sand.box(0.0, width, 0.0, 2.5, kn=2e7, ks=1e7, fric=0.5)
for k in range(6):                                    # layers of different colours
    sand.gen(150, rad=[0.8 * radius, radius], x=(0.0, width), y=(0.14 * k, 0.14 * (k + 1)),
             color=('yellow', 'mg')[k % 2], group='layer%d' % k)
sand.prop(density=1900.0, kn=2e7, ks=1e7, fric=0.5, damp=0.4)
sand.cycle(40000)
sand.prop(damp=0.0)                                   # no damping of flying bodies

top = sand.extents()['top']
pcdc model new
pcdc model gravity (0,-9.81)
pcdc mesh structured (0.95,[top + 0.04]) (1.45,[top + 0.39]) cells 10 7 group 'boulder' set 'domain'
pcdc element c-model mech-iso-e property density 2600 young 1e9 poisson-r 0.25 damp-factor 0.1 friction 30
pcdc face-joint c-model c-i-c-i property friction 35 cohesion 6e5 tensile-strength 2e5 gf1 2 gf2 8 penalty-normal 1e10
pcdc node initial velocity (1.5,[-drop])
pcdc output vtk 'boulder' every 8000
sand.set(print=8000, dt=6e-6)                         # the joints of the boulder need a smaller time step

both = hpcdem.couple(sand, friction=0.6)
for k in range(4):
    pcdc model step 8000
    print('t %.3f s: %d contacts, force of the sand (%.1f, %.1f) kN' % (
        pcdc.time, len(both.contacts()['id']), both.force()[0] / 1e3, both.force()[1] / 1e3))
