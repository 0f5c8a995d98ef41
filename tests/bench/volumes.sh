#!/bin/sh
# Compares meshes of isosurfaces with VTK's flying edges on one thread: CPU seconds and the errors of normals. Exits 1 when a
# bound is exceeded: twice the time of flying edges with normals, and smaller errors of normals than theirs.
# Needs Python with VTK (Debian: python3-vtk9).
#   volumes.sh LEVELSMITH HEAD.nii.gz
set -eu
[ $# -eq 2 ] || { sed -n '2,5s/^# *//p' "$0"; exit 2; }
"${PYTHON:-/usr/bin/python3}" -c 'import vtk' 2>/dev/null || { echo "volumes.sh: VTK for Python is missing; install python3-vtk9"; exit 2; }
exec "${PYTHON:-/usr/bin/python3}" "$(dirname "$0")/volumes.py" "$1" "$2"
