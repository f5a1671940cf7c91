"""The page of fields of particles and quantities of blocks, made from their tables."""

from __future__ import annotations

from hpcdem.core.fields import FIELDS
from hpcdem.physics.bolts.model import QUANTITIES as OF_BOLTS
from hpcdem.physics.fdem.diagnostics import QUANTITIES
from hpcdem.physics.flow.values import QUANTITIES as OF_FLOW
from hpcdem.physics.liners.model import QUANTITIES as OF_LINERS
from scripts.lib.pages.markdown import escaped

_TOP = """\
# Fields

This page lists the fields that frames, views and histories can contain. It is generated from the tables of the program
by `./scripts/pages`; do not edit it. File formats: [Files](files.md). `hpcdem draw FRAME --list` lists the fields of a
frame.

PCDC scripts write names with hyphens (`stress-xx`), frames and Python with underscores; Python accepts both. Units are
those of two dimensions, where forces, energies and rates are per metre of thickness; in three dimensions N/m becomes N,
J/m becomes J, and m2/s becomes m3/s.

In views (`hpcdem draw`, the page, `output image`, filters, Python's `sim.frame()`) each vector of a frame is a field by
its length and by its components: `displacement`, `displacement_x`, `displacement_y`, in space `displacement_z`; so are
`velocity` of elements, discs, clumps, walls, bolts and liners, `force` of discs, clumps, walls, contacts and bonds,
`contact_force`, `nodal_force` and `acceleration` ([Views](view.md)).

## Particles

| field | unit | |
|---|---|---|
"""


def page() -> str:
    """The whole page, in Markdown."""
    lines = [_TOP.rstrip("\n")]
    lines += [f"| `{name}` | {field.unit} | {escaped(field.doc)} |" for name, field in FIELDS.items()]
    for kind in dict.fromkeys(q.on for q in QUANTITIES.values()):
        lines += [
            "",
            f"## Blocks: {kind}",
            "",
            "| quantity | unit | | plane, space | frames |",
            "|---|---|---|---|---|",
        ]
        for name, q in QUANTITIES.items():
            if q.on == kind:
                where = ", ".join(f"{d}-D" for d in q.dims)
                lines.append(f"| `{name}` | {q.unit} | {escaped(q.doc)} | {where} | {'yes' if q.framed else ''} |")
    for group in (OF_FLOW, OF_BOLTS, OF_LINERS):
        for kind, of in group.items():
            lines += ["", f"## Blocks: {kind}", "", "| quantity | unit | |", "|---|---|---|"]
            lines += [f"| `{name}` | {unit} | {escaped(doc)} |" for name, (unit, doc) in of.items()]
    return "\n".join(lines) + "\n"
