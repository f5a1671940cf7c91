#!/bin/bash
# One node, all its cores as MPI ranks:   sbatch one_node.sh push.py
# The results are the same, bit for bit, for every number of ranks.

#SBATCH --job-name=hpcdem
#SBATCH --nodes=1
#SBATCH --ntasks=32              # ranks: as many as the node has cores; some 5 000 particles per rank or more pay
#SBATCH --cpus-per-task=1
#SBATCH --time=12:00:00
#SBATCH --signal=USR1@300        # five minutes before the end: write a checkpoint and stop
#SBATCH --output=%x-%j.out
##SBATCH --partition=...         # as your cluster calls it
##SBATCH --hint=nomultithread    # hyper-threads do not pay

set -euo pipefail

# Where hpcdem is installed. Module loads, if any, belong here too.
export PATH="${HPCDEM_BIN:-$HOME/hpcdem/.venv/bin}:$PATH"

# How srun tells the ranks about each other has to suit the MPI library:
#   pmi2 for the MPI wheel (extra [mpi]) and other MPICHs, pmix for Open MPI. `srun --mpi=list` shows what there is.
export SLURM_MPI_TYPE="${SLURM_MPI_TYPE:-pmi2}"

# srun does not take --cpus-per-task from sbatch any more (since Slurm 22.05).
export SRUN_CPUS_PER_TASK="${SLURM_CPUS_PER_TASK:-1}"

srun hpcdem "$@"
