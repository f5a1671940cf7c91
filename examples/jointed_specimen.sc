# Uniaxial compression of a jointed rock specimen, 50 x 100 mm.
#
# Three closed joints lie at 45 degrees to the load. Wing cracks grow from their tips towards the load, in tension; then
# the rock bridges between joints and surface fail. About 40 s on one core. Needs the extra [mesh] (Gmsh).
#
#   hpcdem jointed_specimen.sc        figure, histories and curve.png in data/
#   hpcdem movie data
import math

width, height, size = 0.05, 0.10, 0.0022
young, poisson = 30e9, 0.25
speed = 0.05                                      # of each platen [m/s]: waves cross the specimen 50 times per 0.1 %

pcdc model new
pcdc geometry create rectangle (0,0) ([width],[height]) as-layer 'outline'
half = 0.5 * 0.014 * math.sqrt(0.5)               # of a joint of 14 mm, along x and along y
for y in (0.035, 0.050, 0.065):
    pcdc geometry create polyline ([width/2 - half],[y - half]) ([width/2 + half],[y + half]) as-layer 'joints'
pcdc mesh create from-layer 'outline' size [size] crack 'joints' irregular group 'rock' set 'domain'

pcdc element c-model mech-iso-e property density 2650 young [young] poisson-r [poisson] damp-factor 0.3
pcdc face-joint c-model c-i-c-i property friction 35 cohesion 12e6 tensile-strength 4e6 gf1 20 gf2 200
# A low penalty permits a large time step; contacts of broken joints keep the stiffness of the joint anyway.
pcdc element-face c-model contact-m-c property friction 25 penalty-normal [2*young] penalty-shear [2*young]

pcdc node group 'bottom' set 'ends' range y 0 0
pcdc node group 'top' set 'ends' range y [height] [height]
for name, v in (('bottom', speed), ('top', -speed)):
    pcdc table create '[name]' values (0,0) (1e-4,[v])
    pcdc node boundary mech-vel-b-c velocity-y table '[name]' range group '[name]' set 'ends'

pcdc history create 'load' node value reaction-y sum every 50 range group 'top' set 'ends'
pcdc history create 'displacement' node value displacement-y mean every 50 range group 'top' set 'ends'
pcdc history create 'cracks' model value broken-joints every 50
pcdc output vtk 'specimen' every 1000

# Load until the stress has fallen below half of its peak.
peak = stress = 0.0
while stress >= 0.5 * peak and pcdc.time < 3e-3:
    pcdc model step 500
    stress = -pcdc.history('load')[-1, 2] / width
    peak = max(peak, stress)
print('strength %.1f MPa, %d joints broken' % (peak / 1e6, pcdc.history('cracks')[-1, 2]))

pcdc chart create 'curve' x-label 'shortening (%)' y-label 'axial stress (MPa)'
pcdc chart add 'curve' x 'displacement' scale-x [-200/height] y 'load' scale-y [-1e-6/width] label 'specimen'
pcdc chart export 'curve' 'curve.png'
