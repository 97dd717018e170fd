#!/bin/bash
# One render shared by the jobs of a Slurm array, then merged: to the bit what one run of all passes would find.
#
#   sbatch scripts/slurm-array.sh                        # renders; note the job's number
#   sbatch --dependency=afterok:NUMBER --array=0 scripts/slurm-array.sh merge
#
# Killed or requeued jobs are submitted again as they are: each goes on from its checkpoint. Without Slurm, the same by hand:
#
#   for task in 0 1 2 3; do TASKS=4 SLURM_ARRAY_TASK_ID=$task scripts/slurm-array.sh; done
#   TASKS=4 scripts/slurm-array.sh merge
#
# Set from outside: SCENE, OUT, PASSES (of each task), TASKS (as many as --array has), OPTIONS (of luxmap render, the same for
# all tasks), LUXMAP (the command). Paths are relative to where the job is submitted.
#SBATCH --job-name=luxmap
#SBATCH --array=0-15
#SBATCH --cpus-per-task=8
#SBATCH --time=04:00:00
#SBATCH --requeue
set -euo pipefail

scene=${SCENE:-scenes/seed-office.toml}
out=${OUT:-out/array}
passes=${PASSES:-8}
tasks=${TASKS:-${SLURM_ARRAY_TASK_COUNT:-16}}
luxmap=${LUXMAP:-luxmap}
threads=${SLURM_CPUS_PER_TASK:-}
read -r -a options <<< "${OPTIONS:-}"
mkdir -p "$out/states"

if [ "${1:-render}" = merge ]; then
    # --array=0 is one task: TASKS must say how many there were, unless all states in the folder belong together.
    states=("$out"/states/*.state)
    if [ -n "${TASKS:-}" ] && [ "${#states[@]}" -ne "$tasks" ]; then
        echo "found ${#states[@]} states in $out/states, expected $tasks: a task is missing" >&2
        exit 1
    fi
    exec "$luxmap" merge --quiet --output "$out/merged" ${threads:+--threads "$threads"} "${states[@]}"
fi

# Task i does the passes from i·PASSES on: each pass draws from random streams of its own number.
task=${SLURM_ARRAY_TASK_ID:?set by Slurm, or by hand}
exec "$luxmap" render "$scene" --quiet --output "$out/task-$task" ${threads:+--threads "$threads"} \
    --first-pass $((task * passes)) --passes "$passes" --checkpoint "$out/states/$(printf '%05d' "$task").state" \
    ${options[@]+"${options[@]}"}
