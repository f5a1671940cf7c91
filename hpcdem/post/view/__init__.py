"""Views: which objects of a frame are shown, and how.

model.py says what a view is, and reads and writes it (`*.mv`); moment.py reads frames, column by column; filter.py
chooses objects by an expression; scene.py puts them together: what is where in which colour. A scene becomes a figure
for paper in paper.py.
"""
