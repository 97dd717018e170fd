#!/bin/sh
# Runs check_blender.py on the EXR files named, in whatever Blender there is; skips where there is none.
set -eu
here=$(dirname "$0")
if command -v blender >/dev/null; then
    for file; do blender --background --factory-startup --python-exit-code 1 --python "$here/check_blender.py" -- "$file"; done
    exit
fi
venv=target/blender
python3 -m venv "$venv"
if ! "$venv/bin/python" -c 'import bpy' 2>/dev/null && ! "$venv/bin/pip" install --quiet bpy; then
    echo "check-blender: skipped, neither blender nor a bpy for $(python3 --version) found"
    exit 0
fi
for file; do "$venv/bin/python" "$here/check_blender.py" "$file"; done
