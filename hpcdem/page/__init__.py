"""The interactive page of `hpcdem grade --serve`: a grading curve becomes a specimen while sliders are moved.

server.py speaks HTTP, with this machine only; worker.py asks a process of its own for specimens and files, and ends it
when nobody waits for the answer any more; maker.py is that process; static/ is what the browser gets.
"""
