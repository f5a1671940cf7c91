# A block falls on discs; the script steers by what it asks of the particles.
import os
import signal
import hpcdem

sand = hpcdem.Simulation(outdir='sand')
sand.set(disk='on', gravity=(0.0, -9.81), dt=2e-5, seed=2)
sand.box(0.0, 1.0, 0.0, 1.5, kn=2e6, ks=1e6, fric=0.3)
sand.gen_grid([0.04], x=(0.0, 1.0), y=(0.0, 0.33))
sand.prop(density=2000.0, kn=2e6, ks=1e6, fric=0.4, damp=0.2)
sand.cycle(200)
top = sand.extents()['top']
pcdc model new
pcdc model gravity (0,-9.81)
pcdc mesh structured (0.2,[top + 0.002]) (0.8,[top + 0.202]) cells 6 2 group 'block' set 'domain'
pcdc element c-model mech-iso-e property density 2600 young 1e8 poisson-r 0.25 damp-factor 0.1
pcdc face-joint c-model c-i-c-i property friction 35 cohesion 6e4 tensile-strength 2e4 gf1 0.05 gf2 0.2 penalty-normal 1e9
pcdc node initial velocity (0.3,-3)
pcdc history create 'vy' node value velocity-y id 0 every 30
pcdc output vtk 'block' every 90
sand.set(print=100, vtk=170, ps=150, save=70, energy=60, stepbar=40)
sand.hist(1, 25, 'kinetic')
sand.hist(2, 25, 'contacts')
sand.plot(1, 2)
both = hpcdem.couple(sand)
called = []


def brake(particles):                                 # in the middle of a command
    called.append(particles.kinetic_energy())
    if len(called) in (2, 7):
        particles.prop(where='y 0 0.1', fric=0.1 * len(called))
    return len(called) == 9                           # ends the command, in the fifth turn


brakes = sand.every(30, brake)
for turn in range(8):
    load = both.force()[1]
    steps = 60 if load > 0.0 else 40
    if turn == 5 and os.path.exists('stop'):
        os.kill(os.getpid(), signal.SIGTERM)
    pcdc model step [steps]
    deep = sand.gather('y').max()
    if turn == 2:                                     # particles change, too
        sand.prop(damp=0.0)
        print('turn: %d of %d discs are gone' % (sand.delete('x 0 0.1'), sand.count))
    print('turn %d: %d steps, %r %r %r' % (turn, steps, load, deep, sand.wall_forces()[100]))
    if os.path.exists('peep'):
        peep = sand['x']
print('turn: %r' % called)
pcdc model save 'end.sav'
