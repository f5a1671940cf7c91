#!/bin/bash
# A run longer than the queue allows:   sbatch restart_chain.sh push.py
# When time is nearly up hpcdem writes a checkpoint and leaves with code 85; the job then puts itself back into the
# queue and goes on from there, until the script has come to its end. The result is the same, bit for bit, as that of
# one long run, and the ranks may be another number each time.

#SBATCH --job-name=hpcdem
#SBATCH --nodes=1
#SBATCH --ntasks=32
#SBATCH --cpus-per-task=1
#SBATCH --time=04:00:00          # one link of the chain; hpcdem asks Slurm for the end of the job by itself
#SBATCH --signal=USR1@300        # a second reminder, five minutes before the end: write a checkpoint and stop
#SBATCH --requeue                # the job may be put back, by itself or after a node has failed
#SBATCH --open-mode=append       # all links write into one log
#SBATCH --output=%x-%j.out
##SBATCH --partition=...         # as your cluster calls it

set -uo pipefail                 # no -e: the exit code of srun is what this script is about

# Where hpcdem is installed. Module loads, if any, belong here too.
export PATH="${HPCDEM_BIN:-$HOME/hpcdem/.venv/bin}:$PATH"

# pmi2 for MPICH and its wheel, pmix for Open MPI. `srun --mpi=list` shows what there is.
export SLURM_MPI_TYPE="${SLURM_MPI_TYPE:-pmi2}"

# srun does not take --cpus-per-task from sbatch any more (since Slurm 22.05).
export SRUN_CPUS_PER_TASK="${SLURM_CPUS_PER_TASK:-1}"

# A job that was put back carries the number of its restarts.
resume=()
if ((${SLURM_RESTART_COUNT:-0} > 0)); then resume=(--resume); fi

srun hpcdem "$@" "${resume[@]}"
code=$?

if ((code == 85)); then          # stopped with a checkpoint
    # Where requeueing is forbidden, submit the next link instead:
    #   sbatch "$0" "$@" --resume
    scontrol requeue "$SLURM_JOB_ID"
    sleep 60                     # the queue ends this script meanwhile
fi
exit "$code"
