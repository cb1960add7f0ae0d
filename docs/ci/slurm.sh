#!/bin/bash
# A Slurm array: one part of the suite a task, each on a GPU of its own. The next line submits four.
#     sbatch --array=1-4 slurm.sh
#SBATCH --job-name=afterlight
#SBATCH --gpus-per-task=1
#SBATCH --cpus-per-task=4
#SBATCH --time=00:30:00
set -euo pipefail

PART=$SLURM_ARRAY_TASK_ID PARTS=$SLURM_ARRAY_TASK_COUNT
afterlight ci "${SUITE:-full}" -o "out-$PART" --shard "$PART/$PARTS" --jobs "${SLURM_CPUS_PER_TASK:-4}" ${BASELINE:+--baseline "$BASELINE"}
