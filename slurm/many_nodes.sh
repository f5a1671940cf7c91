#!/bin/bash
# Several nodes:   sbatch many_nodes.sh push.py
# Ranks own vertical strips of the model and talk to their neighbours only; a strip must be wider than a few particles,
# and hpcdem says how many ranks would fit when there are too many.

#SBATCH --job-name=hpcdem
#SBATCH --nodes=4
#SBATCH --ntasks-per-node=32     # ranks on each node
#SBATCH --cpus-per-task=1        # with threads: 2 here, half the ranks above, and -j 2 below
#SBATCH --exclusive              # the slowest rank sets the pace: no neighbours on the nodes
#SBATCH --distribution=block     # neighbouring strips on the same node, so that few messages cross the network
#SBATCH --time=24:00:00
#SBATCH --signal=USR1@300        # five minutes before the end: write a checkpoint and stop
#SBATCH --output=%x-%j.out
##SBATCH --partition=...         # as your cluster calls it
##SBATCH --hint=nomultithread    # hyper-threads do not pay

set -euo pipefail

# Where hpcdem is installed, on a file system that all nodes see. Between nodes the cluster's own MPI knows the network
# best: load its module, build mpi4py with it and leave the extra [mpi] out.
export PATH="${HPCDEM_BIN:-$HOME/hpcdem/.venv/bin}:$PATH"
# module load openmpi

# pmix for Open MPI, pmi2 for MPICH and its wheel. `srun --mpi=list` shows what there is.
export SLURM_MPI_TYPE="${SLURM_MPI_TYPE:-pmix}"

# srun does not take --cpus-per-task from sbatch any more (since Slurm 22.05).
export SRUN_CPUS_PER_TASK="${SLURM_CPUS_PER_TASK:-1}"

# Compiled kernels are kept in ~/.cache/hpcdem, which serves a few nodes well (fill it once on the login node with
# `hpcdem warmup`). For many nodes take each node's own disk: one rank of each node compiles, for its node. The folder
# must be ours alone, because compiled code is run as it is found.
export NUMBA_CACHE_DIR="${NUMBA_CACHE_DIR:-${TMPDIR:-/tmp}/hpcdem-kernels-$UID}"
srun --nodes="$SLURM_JOB_NUM_NODES" --ntasks-per-node=1 --mpi=none \
    bash -c 'mkdir -p -m 700 "$NUMBA_CACHE_DIR" && [[ -O $NUMBA_CACHE_DIR ]]'

srun --kill-on-bad-exit=1 hpcdem "$@"
