# Uniaxial compression of a specimen of rock, 52 x 108 mm: a ready-made model, with one additional line.
#
# `hpcdem case ucs` writes the whole script of UCS(); `hpcdem case ucs --help` lists its parameters. The specimen
# fails along steep shear bands and splits along the load. Two minutes on one core. Needs the extra [mesh].
#
#   hpcdem ucs.sc             ucs.png, figure, histories and frames in data/
#   hpcdem movie data
from hpcdem.cases import UCS

case = UCS(cohesion=10e6, friction=30, tensile_strength=2e6)
case.build()

# Lateral displacement of the sides
for name, x in (('left', 0), ('right', case.width)):
    pcdc history create '[name]' node nearest ([x],[case.height/2]) value displacement-x every 500

result = case.load()
bulge = pcdc.history('right')[-1, 2] - pcdc.history('left')[-1, 2]
print('at the end it is %.2f mm wider than at the beginning' % (1e3 * bulge))
