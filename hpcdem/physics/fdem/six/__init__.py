"""The six-node triangle: quadratic displacements, straight sides in the mesh, elastic.

It is stored as four triangles of the mesh (elements/kind.py), which bring mass, joints, contact and loads on straight
half sides and no stress; its own forces come on top. So that half sides and parts act on it as quadratic displacements
would have it, the nodes between its corners do not stand on its sides but where the straight half sides enclose the
same area as the parabola: y = x + (2 x - x_i - x_j) / 6, x: the middle of side i j. In the mesh, and wherever
displacements are linear, that is the same. A uniform traction on both halves is then consistent (1/6, 2/3, 1/6 of it at
the nodes), and so are gravity and the masses of the parts (1/12 and 1/4 of the element).
"""
