"""The interactive pages: of `hpcdem grade --serve`, where a grading curve becomes a specimen while sliders are moved,
and of `hpcdem view`, which shows frames.

server.py speaks HTTP, with this machine only, and lifetime.py keeps it alive until Ctrl-C. Specimens: worker.py asks a
process of its own for specimens and files, and ends it when nobody waits for the answer any more; maker.py is that
process. Frames: viewer.py answers, sources.py knows the frames, exports.py makes files. static/ is what the browser
gets.
"""
