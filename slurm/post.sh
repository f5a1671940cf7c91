#!/bin/bash
# Pictures of all frames of a finished run, one process:   sbatch post.sh data
# To start it when a run has ended well:   sbatch --dependency=afterok:JOBID post.sh data

#SBATCH --job-name=hpcdem-post
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --time=01:00:00
#SBATCH --output=%x-%j.out
##SBATCH --partition=...         # as your cluster calls it

set -euo pipefail

# Where hpcdem is installed. Module loads, if any, belong here too.
export PATH="${HPCDEM_BIN:-$HOME/hpcdem/.venv/bin}:$PATH"

srun zdem2jpg --dir="${1:-data}"
