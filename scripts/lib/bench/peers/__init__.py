"""Other codes on the same particles. Each module writes the input for its code and reads the result."""

from __future__ import annotations

from bench.peers.base import Peer
from bench.peers.esys import Esys
from bench.peers.lammps import Lammps
from bench.peers.liggghts import Liggghts
from bench.peers.yade import Yade

PEERS: dict[str, type[Peer]] = {peer.name: peer for peer in (Lammps, Liggghts, Yade, Esys)}
